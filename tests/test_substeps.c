#include "scene_tools.h"
int main(void){return 0;}
