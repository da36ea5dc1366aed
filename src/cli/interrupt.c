#include "interrupt.h"

#include <signal.h>
#include <stddef.h>

#include "output.h"

static volatile sig_atomic_t expected, received;

static void receive(int number)
{
    if (expected && !received && (number == SIGINT || number == SIGTERM)) {
        received = number;
        return;
    }
    outputs_abandon();
    signal(number, SIG_DFL);
    raise(number); /* is delivered when this handler returns */
}

void interrupts_begin(void)
{
    static const int numbers[] = {SIGINT, SIGTERM, SIGHUP, SIGPIPE};
    for (size_t k = 0; k < sizeof numbers / sizeof *numbers; ++k) {
        struct sigaction action;
        if (sigaction(numbers[k], NULL, &action) != 0 || action.sa_handler == SIG_IGN) continue;
        action.sa_handler = receive;
        action.sa_flags = SA_RESTART;
        sigemptyset(&action.sa_mask);
        sigaction(numbers[k], &action, NULL);
    }
}

void interrupts_expect(void) { expected = 1; }

int interrupted(void) { return received; }

int interrupted_status(int code) { return received ? 128 + received : code; }
