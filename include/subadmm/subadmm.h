/* Everything: rigid bodies in exact frictional contact, on CPU cores and NVIDIA GPUs. */
#ifndef SUBADMM_SUBADMM_H
#define SUBADMM_SUBADMM_H

#include "arrays.h"
#include "coupling.h"
#include "draw.h"
#include "environments.h"
#include "events.h"
#include "gear.h"
#include "hull.h"
#include "id.h"
#include "joint.h"
#include "manifold.h"
#include "mass.h"
#include "mesh.h"
#include "mesh_file.h"
#include "problem.h"
#include "query.h"
#include "save.h"
#include "scenes.h"
#include "settings.h"
#include "status.h"
#include "tasks.h"
#include "types.h"
#include "world.h"

#endif
