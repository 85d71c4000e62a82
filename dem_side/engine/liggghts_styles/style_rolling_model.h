// SPDX-License-Identifier: GPL-2.0-or-later
// LIGGGHTS' build generates a list of its rolling models under this name. kerf instantiates none of them.
