/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef EXM_REGISTRATION_SCAN_CLOUD_H
#define EXM_REGISTRATION_SCAN_CLOUD_H

#include "registration/scan.h"

/** Normals without sign, boundaries, areas and ways of a scan that is a cloud, from each point's nearest neighbours. */
exm_status scan_cloud(scan *s, size_t neighbor_count);

#endif
