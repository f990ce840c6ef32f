# SPDX-License-Identifier: GPL-3.0-or-later
"""Scans and registrations."""

from ctypes import POINTER, Structure, c_char_p, c_double, c_int32, c_size_t, c_void_p

from .blended import CBlendedBindSettings
from .common import ARRAY, MESH, STATUS, Progress

SCAN = c_void_p
REGISTRATION = c_void_p
UNSEEN = 0xFFFFFFFF


class CScanSettings(Structure):
    _fields_ = [
        ("struct_size", c_size_t),
        ("triangles", c_void_p),
        ("triangle_count", c_size_t),
        ("normals", c_void_p),
        ("neighbor_count", c_size_t),
    ]


class CScanReport(Structure):
    _fields_ = [
        ("struct_size", c_size_t),
        ("point_count", c_size_t),
        ("triangle_count", c_size_t),
        ("boundary_point_count", c_size_t),
        ("signed_normals", c_int32),
        ("diagonal", c_double),
        ("spacing", c_double),
    ]


class CLandmarks(Structure):
    _fields_ = [
        ("count", c_size_t),
        ("vertices", c_void_p),
        ("points", c_void_p),
        ("weights", c_void_p),
    ]


class CMatchSettings(Structure):
    _fields_ = [
        ("struct_size", c_size_t),
        ("scale", c_int32),
        ("known_scale", c_double),
        ("margin", c_double),
    ]


class CMatchReport(Structure):
    _fields_ = [
        ("struct_size", c_size_t),
        ("energy", c_double),
        ("second", c_double),
        ("margin", c_double),
        ("mirrored", c_int32),
        ("permissible", c_size_t),
        ("solved", c_size_t),
        ("seconds", c_double),
    ]


class CFitSettings(Structure):
    _fields_ = [
        ("struct_size", c_size_t),
        ("scale", c_int32),
        ("known_scale", c_double),
        ("start", c_int32),
        ("disc_radius", c_double),
        ("disc_count", c_size_t),
        ("iterations", c_int32),
        ("sample_count", c_size_t),
        ("reach", c_double),
        ("max_angle", c_double),
        ("tightness", c_double),
        ("landmark_share", c_double),
        ("finish", c_int32),
        ("detail", c_double),
        ("thread_count", c_int32),
        ("reject_landmarks", c_int32),
    ]


class CFitReport(Structure):
    _fields_ = [
        ("struct_size", c_size_t),
        ("quality", c_double),
        ("scale", c_double),
        ("exemplar", c_size_t),
        ("seen", c_double),
        ("residual", c_double),
        ("landmark_residual", c_double),
        ("worst_landmark", c_size_t),
        ("worst_residual", c_double),
        ("energy", c_double),
        ("iterations", c_int32),
        ("converged", c_int32),
        ("seconds", c_double),
        ("start_seconds", c_double),
        ("icp_seconds", c_double),
        ("finish_seconds", c_double),
        ("match_seconds", c_double),
        ("rejected_count", c_size_t),
    ]


class CRegistrationInfo(Structure):
    _fields_ = [
        ("struct_size", c_size_t),
        ("vertex_count", c_size_t),
        ("exemplar_count", c_size_t),
        ("atom_count", c_size_t),
        ("point_count", c_size_t),
        ("landmark_count", c_size_t),
        ("size", c_double),
        ("create_seconds", c_double),
    ]


FUNCTIONS = {
    # void exm_scan_settings_init(exm_scan_settings *settings);
    "exm_scan_settings_init": (None, POINTER(CScanSettings)),
    # exm_status exm_scan_create(const float *points, size_t point_count,
    #                            const exm_scan_settings *settings, exm_scan **out);
    "exm_scan_create": (STATUS, ARRAY, c_size_t, POINTER(CScanSettings), POINTER(SCAN)),
    # exm_status exm_scan_read(const char *path, exm_scan **out);
    "exm_scan_read": (STATUS, c_char_p, POINTER(SCAN)),
    # void exm_scan_destroy(exm_scan *scan);
    "exm_scan_destroy": (None, SCAN),
    # void exm_scan_report_init(exm_scan_report *report);
    "exm_scan_report_init": (None, POINTER(CScanReport)),
    # exm_status exm_scan_get_report(const exm_scan *scan, exm_scan_report *report);
    "exm_scan_get_report": (STATUS, SCAN, POINTER(CScanReport)),
    # exm_status exm_scan_get_arrays(const exm_scan *scan, float *points, uint32_t *triangles,
    #                                float *normals, uint8_t *boundary);
    "exm_scan_get_arrays": (STATUS, SCAN, ARRAY, ARRAY, ARRAY, ARRAY),
    # exm_status exm_scan_nearest(const exm_scan *scan, const double *queries, size_t count,
    #                             uint32_t *indices, double *distances);
    "exm_scan_nearest": (STATUS, SCAN, ARRAY, c_size_t, ARRAY, ARRAY),
    # exm_status exm_registration_create(const exm_mesh *mesh, const float *exemplars,
    #                                    size_t exemplar_count,
    #                                    const exm_blended_bind_settings *settings,
    #                                    exm_progress progress, void *user,
    #                                    exm_registration **out);
    "exm_registration_create": (
        STATUS,
        MESH,
        ARRAY,
        c_size_t,
        POINTER(CBlendedBindSettings),
        Progress,
        c_void_p,
        POINTER(REGISTRATION),
    ),
    # void exm_registration_destroy(exm_registration *registration);
    "exm_registration_destroy": (None, REGISTRATION),
    # void exm_registration_match_settings_init(exm_registration_match_settings *settings);
    "exm_registration_match_settings_init": (None, POINTER(CMatchSettings)),
    # void exm_registration_match_report_init(exm_registration_match_report *report);
    "exm_registration_match_report_init": (None, POINTER(CMatchReport)),
    # exm_status exm_registration_match(exm_registration *registration,
    #                                   const exm_landmarks *landmarks, const int32_t *groups,
    #                                   const exm_registration_match_settings *settings,
    #                                   exm_progress progress, void *user, uint32_t *order,
    #                                   uint32_t *second, exm_registration_match_report *report);
    "exm_registration_match": (
        STATUS,
        REGISTRATION,
        POINTER(CLandmarks),
        ARRAY,
        POINTER(CMatchSettings),
        Progress,
        c_void_p,
        ARRAY,
        ARRAY,
        POINTER(CMatchReport),
    ),
    # void exm_registration_fit_settings_init(exm_registration_fit_settings *settings);
    "exm_registration_fit_settings_init": (None, POINTER(CFitSettings)),
    # void exm_registration_fit_report_init(exm_registration_fit_report *report);
    "exm_registration_fit_report_init": (None, POINTER(CFitReport)),
    # exm_status exm_registration_fit(exm_registration *registration, const exm_scan *scan,
    #                                 const exm_landmarks *landmarks,
    #                                 const exm_registration_fit_settings *settings,
    #                                 exm_progress progress, void *user,
    #                                 exm_registration_fit_report *report);
    "exm_registration_fit": (
        STATUS,
        REGISTRATION,
        SCAN,
        POINTER(CLandmarks),
        POINTER(CFitSettings),
        Progress,
        c_void_p,
        POINTER(CFitReport),
    ),
    # exm_status exm_registration_positions(const exm_registration *registration,
    #                                       float *positions);
    "exm_registration_positions": (STATUS, REGISTRATION, ARRAY),
    # exm_status exm_registration_vertex_matches(const exm_registration *registration,
    #                                            uint32_t *points, float *distances);
    "exm_registration_vertex_matches": (STATUS, REGISTRATION, ARRAY, ARRAY),
    # exm_status exm_registration_scan_matches(const exm_registration *registration,
    #                                          uint32_t *vertices, uint32_t *triangles,
    #                                          float *barycentric, float *distances);
    "exm_registration_scan_matches": (STATUS, REGISTRATION, ARRAY, ARRAY, ARRAY, ARRAY),
    # exm_status exm_registration_landmark_residuals(const exm_registration *registration,
    #                                                double *residuals);
    "exm_registration_landmark_residuals": (STATUS, REGISTRATION, ARRAY),
    # void exm_registration_info_init(exm_registration_info *info);
    "exm_registration_info_init": (None, POINTER(CRegistrationInfo)),
    # exm_status exm_registration_get_info(const exm_registration *registration,
    #                                      exm_registration_info *info);
    "exm_registration_get_info": (STATUS, REGISTRATION, POINTER(CRegistrationInfo)),
}
