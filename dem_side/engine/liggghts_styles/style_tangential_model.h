// SPDX-License-Identifier: GPL-2.0-or-later
// LIGGGHTS' build generates a list of its tangential models under this name. kerf instantiates none of them.
