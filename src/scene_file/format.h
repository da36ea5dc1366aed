/* What a scene file says of itself. */
#ifndef SADMM_SCENE_FILE_FORMAT_H
#define SADMM_SCENE_FILE_FORMAT_H

#define SADMM_SCENE_FORMAT "subadmm scene"
enum { SADMM_SCENE_FORMAT_VERSION = 1 };
/* How the friction of two shapes makes that of the pair: there is one way. */
#define SADMM_SCENE_PAIR_FRICTION "geometric mean"

#endif
