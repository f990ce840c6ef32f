/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef EXM_REGISTRATION_MATCH_H
#define EXM_REGISTRATION_MATCH_H

#include "registration/registration.h"

typedef struct match_request {
  exm_landmarks landmarks; /* checked */
  const int32_t *groups;   /* [count] */
  exm_registration_match_settings settings;
  progress report;
} match_request;

/** See exm_registration_match. second may be NULL. */
exm_status registration_match(registration *r, const match_request *request, uint32_t *order, uint32_t *second,
                              exm_registration_match_report *report);

#endif
