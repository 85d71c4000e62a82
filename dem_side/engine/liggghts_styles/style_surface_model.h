// SPDX-License-Identifier: GPL-2.0-or-later
// LIGGGHTS' build generates a list of its surface models under this name. Only the default one is named by other headers.
#include "surface_model_default.h"
