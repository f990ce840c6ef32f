/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef EXM_REGISTRATION_SCAN_SURFACE_H
#define EXM_REGISTRATION_SCAN_SURFACE_H

#include "registration/scan.h"

/** Normals, boundaries, areas and ways of a scan that is a surface, from its triangles. */
exm_status scan_surface(scan *s);

#endif
