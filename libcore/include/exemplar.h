/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * Exemplar: pose a mesh inside the space of shapes its artist sculpted.
 *
 * Conventions, stated once
 *
 *   Naming      exm_<noun>_<verb>; parameters in the order object, inputs, settings, outputs.
 *   Arrays      owned by the caller, passed as pointer and count; positions row-major [n][3].
 *               `create` copies what it keeps. Sizes are checked for overflow.
 *   Sizes       V vertices, F triangles, S exemplars, H handles, G edge groups.
 *   Units       positions in the caller's unit of length, times in seconds. Nothing depends on the scale of the mesh.
 *   Status      0 success; negative: failed, nothing changed, outputs untouched (an `out` handle is set to NULL);
 *               positive: done, with a warning. exm_last_error() says in words what a failure or a warning was about.
 *   Structs     settings and reports begin with struct_size; call their _init function first, then change fields.
 *               That is how they can grow without breaking a program compiled against an older header.
 *   Threads     one handle is used by one thread at a time; different handles are independent. There is no global
 *               mutable state. exm_last_error() is per thread.
 *   Lifetime    every `create` has a `destroy`; destroy(NULL) does nothing. A deformer does not need its mesh to live.
 *   Silence     nothing is printed, no exception, exit or abort leaves the library. Out of memory is a status.
 *
 * Papers      [AMRAP]  Wampler, "Fast and Reliable Example-Based Mesh IK for Stylized Deformations", SA 2016
 *             [BBW]    Jacobson et al., "Bounded Biharmonic Weights for Real-Time Deformation", SIGGRAPH 2011
 *             [Blended] Shtern, Sela and Kimmel, "Fast Blended Transformations for Partial Shape Registration", 2016
 *             [SSDR]   Le and Deng, "Smooth Skinning Decomposition with Rigid Bones", SIGGRAPH Asia 2012
 *             [FAST]   Jacobson et al., "Fast Automatic Skinning Transformations", SIGGRAPH 2012
 *             [Rigidity]  Chen, Gao, Lai and Xia, "Rigidity Controllable As-Rigid-As-Possible Shape Deformation",
 *                         Graphical Models 2017
 *             [SEQ]    Cashman and Hormann, "A continuous, editable representation for deforming mesh sequences with
 *                      separate signals for time, pose and shape", Eurographics 2012
 */
#ifndef EXEMPLAR_H
#define EXEMPLAR_H

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

#if defined(_WIN32)
#  if defined(EXM_BUILDING)
#    define EXM_API __declspec(dllexport)
#  else
#    define EXM_API __declspec(dllimport)
#  endif
#elif defined(__GNUC__)
#  define EXM_API __attribute__((visibility("default")))
#else
#  define EXM_API
#endif

/* ------------------------------------------------------------------------------------------------ version, errors */

/** Changes whenever a program compiled against an older header could misbehave. */
#define EXM_ABI_VERSION 1

/** The ABI version the loaded library was built with; compare with EXM_ABI_VERSION before any other call. */
EXM_API uint32_t exm_abi_version(void);

/** "major.minor.patch"; static storage. */
EXM_API const char *exm_version(void);

typedef int32_t exm_status;

#define EXM_OK 0
/* Warnings: the result is usable. */
#define EXM_WARNING_NOT_CONVERGED 1   /* the iteration cap was reached before the tolerance */
#define EXM_WARNING_MESH 2            /* the mesh has flaws that were dealt with; see exm_mesh_report */
#define EXM_WARNING_EXEMPLARS 3       /* exemplars that add nothing, or are turned inside out */
#define EXM_WARNING_UNDERDETERMINED 4 /* the constraints leave a turn or the scale open; it is as in the reference */
#define EXM_WARNING_CONTRADICTORY 5   /* constraints that cannot hold together; they are met in least squares */
#define EXM_WARNING_FIT 6             /* a fit that is doubtful: low quality, or landmarks that contradict each other */
#define EXM_WARNING_AMBIGUOUS 7       /* two correspondences fit about as well */
/* Errors: nothing changed. */
#define EXM_ERROR_ARGUMENT (-1)      /* an argument is NULL, out of range, not finite, or of a mismatched size */
#define EXM_ERROR_OUT_OF_MEMORY (-2) /* an allocation failed, or a size does not fit in memory */
#define EXM_ERROR_CANCELLED (-3)     /* the progress callback asked to stop */
#define EXM_ERROR_TOPOLOGY (-4)      /* the triangles do not describe a usable surface */
#define EXM_ERROR_UNCONSTRAINED (-5) /* a connected part of the mesh has no handle, or no handle that holds it */
#define EXM_ERROR_NUMERIC (-6)       /* a factorisation or an iteration broke down */
#define EXM_ERROR_IO (-7)            /* a file could not be opened, read or understood */
#define EXM_ERROR_INTERNAL (-8)      /* a third-party library failed in a way we did not foresee */

/** What the last failed or warning call of this thread was about: one sentence that names the argument, the index and
 *  the value. Never NULL; "" when nothing has failed yet. Valid until the thread's next exm_ call. */
EXM_API const char *exm_last_error(void);

/** The kind of element that the last failure or warning of this thread is about. */
typedef enum exm_element {
  EXM_ELEMENT_NONE = 0,
  EXM_ELEMENT_VERTEX = 1,
  EXM_ELEMENT_FACE = 2,
  EXM_ELEMENT_HANDLE = 3,
  EXM_ELEMENT_EXEMPLAR = 4,
  EXM_ELEMENT_LANDMARK = 5,
  EXM_ELEMENT_POINT = 6 /* of a scan */
} exm_element;

/** The element at fault, so that a user interface can select it. kind and index may be NULL. */
EXM_API void exm_last_error_element(exm_element *kind, size_t *index);

/**
 * Called now and then by long calls, from the calling thread.
 *
 * fraction  done so far, 0..1, never decreasing
 * stage     what is being done, in a word or two; static storage
 *
 * Return 0 to go on; anything else cancels: the call returns EXM_ERROR_CANCELLED and nothing has changed.
 */
typedef int (*exm_progress)(void *user, double fraction, const char *stage);

/* ------------------------------------------------------------------------------------------------------------ mesh */

typedef struct exm_mesh exm_mesh;

/** What validation found. Element lists are read with exm_mesh_flaws. */
typedef struct exm_mesh_report {
  size_t struct_size;
  size_t vertex_count;
  size_t triangle_count;
  size_t component_count;         /* connected parts, loose vertices counted one by one */
  size_t boundary_edge_count;     /* edges of exactly one triangle */
  size_t non_manifold_edge_count; /* edges of three or more triangles, or of two that disagree in orientation */
  size_t degenerate_face_count;   /* triangles of zero area within rounding; they get a floor of stiffness */
  size_t loose_vertex_count;      /* vertices of no triangle */
  double diagonal;                /* of the bounding box */
} exm_mesh_report;

EXM_API void exm_mesh_report_init(exm_mesh_report *report);

/**
 * A triangle mesh in its reference pose.
 *
 * positions  [V][3] finite
 * triangles  [F][3] 0-based, three different vertices each
 * out        NULL on failure; release with exm_mesh_destroy
 *
 * Returns EXM_WARNING_MESH where edges are non-manifold, faces are degenerate or vertices are loose: the mesh is
 * usable all the same (every energy here is a sum over triangles, and asks for no manifold).
 * Errors: EXM_ERROR_ARGUMENT (NULL, empty, not finite, no extent), EXM_ERROR_TOPOLOGY (index out of range, a repeated
 * corner), EXM_ERROR_OUT_OF_MEMORY.
 */
EXM_API exm_status exm_mesh_create(const float *positions, size_t vertex_count, const uint32_t *triangles,
                                   size_t triangle_count, exm_mesh **out);

/** The same from a file: OBJ, PLY, OFF or STL, polygons fanned into triangles. Also EXM_ERROR_IO. */
EXM_API exm_status exm_mesh_read(const char *path, exm_mesh **out);

EXM_API void exm_mesh_destroy(exm_mesh *mesh);

EXM_API exm_status exm_mesh_get_report(const exm_mesh *mesh, exm_mesh_report *report);

/** positions [V][3], triangles [F][3]; either may be NULL. */
EXM_API exm_status exm_mesh_get_arrays(const exm_mesh *mesh, float *positions, uint32_t *triangles);

typedef enum exm_mesh_flaw {
  EXM_FLAW_NON_MANIFOLD_EDGE = 0, /* vertex pairs, flat: two entries an edge */
  EXM_FLAW_DEGENERATE_FACE = 1,   /* faces */
  EXM_FLAW_LOOSE_VERTEX = 2       /* vertices */
} exm_mesh_flaw;

/** The elements of one flaw: writes at most `capacity` entries and stores in *count how many there are. */
EXM_API exm_status exm_mesh_flaws(const exm_mesh *mesh, exm_mesh_flaw flaw, uint32_t *elements, size_t capacity,
                                  size_t *count);

/**
 * The cotangent weights that every energy here uses: entry [f][i] is half the cotangent of the angle of triangle f at
 * its corner i, and weighs the edge opposite to it. Negative for obtuse angles, which is right: a whole triangle's
 * three terms together are never negative. Degenerate triangles are treated as if their area were a small share of
 * their longest edge squared.
 *
 * cotangents  [F][3]
 */
EXM_API exm_status exm_mesh_cotangents(const exm_mesh *mesh, double *cotangents);

/**
 * Linear functionals of positions, for exm_blended_add_rows: a vertex's geodesic disc, as the mean of the vertices
 * within `radius` along the surface, weighted by their Voronoi areas (coefficients sum to 1).
 *
 * capacity  terms that there is room for; no more are written
 * count     out: how many there are
 */
EXM_API exm_status exm_mesh_disc(const exm_mesh *mesh, uint32_t vertex, double radius, size_t capacity,
                                 uint32_t *vertices, double *coefficients, size_t *count);

/** The same for a vertex's differential coordinate (L v)_i / M_i times the mesh's area, which does not depend on the
 * mesh's size: its own vertex first, then its ring; coefficients sum to 0. Nothing is written where there is not room
 * for all. */
EXM_API exm_status exm_mesh_differential(const exm_mesh *mesh, uint32_t vertex, size_t capacity, uint32_t *vertices,
                                         double *coefficients, size_t *count);

/* --------------------------------------------------------------------------------------------------------- handles */

typedef enum exm_handle_kind {
  EXM_HANDLE_PINNED = 0,   /* the centre of its vertices is held at the target's translation */
  EXM_HANDLE_ORIENTED = 1, /* its whole affine frame is held: centre and linear part */
  EXM_HANDLE_FREE = 2      /* no constraint; extra freedom for the deformation */
} exm_handle_kind;

/**
 * Handles, each a set of vertices. A handle's centre is the mean of its vertices; its frame in a pose is the affine map
 * that takes the reference positions of its vertices to the pose best, in least squares (for a handle whose vertices
 * span no volume, with as many surrounding rings as are needed; directions that stay flat are left free).
 *
 * kinds           [count]
 * vertex_offsets  [count + 1], from 0, increasing: handle h owns vertices[vertex_offsets[h] .. vertex_offsets[h + 1])
 * vertices        [vertex_offsets[count]] no vertex twice, neither within a handle nor in two of them
 */
typedef struct exm_handles {
  size_t count;
  const int32_t *kinds;
  const size_t *vertex_offsets;
  const uint32_t *vertices;
} exm_handles;

/**
 * Bounded biharmonic weights [BBW, eq. 3 with the partition of unity kept]: the weights that minimise the sum of
 * 1/2 w_h' L M^-1 L w_h subject to w >= 0, sum_h w_h = 1, and w_h = 1 on the vertices of handle h.
 *
 * handles   at least one on every connected part of the mesh; kinds are not looked at
 * progress  may be NULL
 * weights   [H][V] out; exactly 1 and 0 on the handles' vertices; columns sum to 1 to rounding;
 *           those below about 1e-5 are left out
 *
 * Errors: EXM_ERROR_ARGUMENT, EXM_ERROR_UNCONSTRAINED, EXM_ERROR_CANCELLED, EXM_ERROR_OUT_OF_MEMORY,
 * EXM_ERROR_NUMERIC. EXM_WARNING_NOT_CONVERGED where the iteration cap was met; the weights still satisfy every
 * constraint.
 */
EXM_API exm_status exm_weights_bounded_biharmonic(const exm_mesh *mesh, const exm_handles *handles,
                                                  exm_progress progress, void *user, float *weights);

/**
 * Laplace-Beltrami eigenfunctions: the first `count` solutions of L f = lambda M f, L the cotangent Laplacian (that of
 * exm_mesh_cotangents) and M the vertices' masses, thirds of the triangles' areas. Every connected part adds an
 * eigenvalue 0; the first function is constant.
 *
 * count      1..V
 * values     [count] out, rising
 * functions  [count][V] out, orthonormal in M
 *
 * Errors: EXM_ERROR_ARGUMENT, EXM_ERROR_CANCELLED, EXM_ERROR_OUT_OF_MEMORY, EXM_ERROR_NUMERIC.
 */
EXM_API exm_status exm_weights_eigenfunctions(const exm_mesh *mesh, size_t count, exm_progress progress, void *user,
                                              double *values, double *functions);

typedef struct exm_decompose_settings {
  size_t struct_size;
  size_t bone_count;  /* 0: as many as it takes for `tolerance`, up to bone_limit */
  double tolerance;   /* of vertices that follow one bone each, root mean square, as a share of the diagonal; default
                         0.01, or a fifth of what a single bone leaves, if that is less. Weights then lower it further */
  size_t bone_limit;  /* default 40 */
  int32_t influences; /* most bones a vertex, 1..8, default 4 */
  int32_t iterations; /* of the alternation, at most; default 20; it ends when little is gained */
} exm_decompose_settings;

EXM_API void exm_decompose_settings_init(exm_decompose_settings *settings);

typedef struct exm_decompose_report {
  size_t struct_size;
  size_t bone_count;  /* found; fewer than asked for where the motion does not tell more apart */
  double begin_error; /* of vertices that follow one bone each, root mean square distance from the exemplars */
  double error;       /* with the weights */
  double max_error;   /* largest distance */
  int32_t iterations;
} exm_decompose_report;

EXM_API void exm_decompose_report_init(exm_decompose_report *report);

/**
 * Skinning weights and rigid bones from exemplars [SSDR]: weights and bone transforms alternate from clusters of
 * vertices that move rigidly.
 *
 * exemplars   [S][V][3] finite poses of the mesh, which itself is the rest pose
 * settings    NULL for the defaults
 * progress    may be NULL
 * capacity    bones that the outputs have room for: settings.bone_count, or bone_limit where that is 0, is enough
 * weights     [capacity][V] out: not negative, columns sum to 1, at most `influences` a vertex; rows behind the bones
 *             found are zero
 * transforms  [S][capacity][3][4] out or NULL: rotation | translation from the rest pose to each exemplar
 * labels      [V] out or NULL: the bone of the largest weight
 * report      may be NULL
 *
 * Errors: EXM_ERROR_ARGUMENT, EXM_ERROR_CANCELLED, EXM_ERROR_OUT_OF_MEMORY.
 */
EXM_API exm_status exm_weights_decompose(const exm_mesh *mesh, const float *exemplars, size_t exemplar_count,
                                         const exm_decompose_settings *settings, exm_progress progress, void *user,
                                         size_t capacity, float *weights, double *transforms, uint32_t *labels,
                                         exm_decompose_report *report);

/* -------------------------------------------------------------------------------------------------------- deformer */

/**
 * A mesh bound to a fixed set of handles: bind once (exm_<kind>_create), solve often. The reduced solve does not see
 * the vertices; exm_deformer_positions does, once a frame.
 */
typedef struct exm_deformer exm_deformer;

typedef enum exm_deformer_kind {
  EXM_DEFORMER_AMRAP = 0,   /* as-multi-rigid-as-possible: exm_amrap_create */
  EXM_DEFORMER_BLENDED = 1, /* fast blended transformations: exm_blended_create */
  EXM_DEFORMER_RIGIDITY = 2 /* as-rigid-as-possible, of adjustable stiffness: exm_rigidity_create */
} exm_deformer_kind;

/** Solve-time settings shared by every kind of deformer. */
typedef enum exm_start {
  EXM_START_STATELESS = 0, /* the result depends on the targets and settings alone: for renders and bakes */
  EXM_START_WARM = 1,      /* goes on from the last solve of this deformer: for dragging */
  EXM_START_POSITIONS = 2  /* goes on from positions that the caller gives; kinds that move every vertex by itself */
} exm_start;

typedef struct exm_solve_report {
  size_t struct_size;
  int32_t converged;          /* 1: stopped by the tolerance */
  int32_t iterations;         /* of the outer alternation */
  double objective;           /* [AMRAP, eq. 10] */
  double elastic_energy;      /* E_d [AMRAP, eq. 9], without the square root */
  double constraint_residual; /* largest distance of a pinned or oriented handle's centre from its target */
  double
      optimality_gap; /* Frank-Wolfe gap of the last cone program: how far its objective is from the optimum at most */
  double seconds;
  /* The objective after each iteration: set a buffer and its capacity to have it; count says how many were written. */
  double *history;
  size_t history_capacity;
  size_t history_count;
} exm_solve_report;

EXM_API void exm_solve_report_init(exm_solve_report *report);

typedef struct exm_deformer_info {
  size_t struct_size;
  size_t vertex_count;
  size_t handle_count;
  size_t exemplar_count;
  size_t edge_group_count;
  size_t coefficient_count; /* degrees of freedom a dimension that are left after the handles */
  int32_t dimension;        /* 2 or 3 */
  double bind_seconds;
  double weight_seconds; /* the part of it spent on weights */
  int32_t kind;          /* exm_deformer_kind */
} exm_deformer_info;

EXM_API void exm_deformer_info_init(exm_deformer_info *info);
EXM_API exm_status exm_deformer_get_info(const exm_deformer *deformer, exm_deformer_info *info);

/**
 * Where exemplar s has the handles, as targets.
 *
 * targets  [H][3][4] out: rows of [linear part | centre]
 */
EXM_API exm_status exm_deformer_handle_pose(const exm_deformer *deformer, size_t exemplar, double *targets);

/** The solved positions, [V][3]; before the first solve, those of the reference. thread_count 0: chosen. */
EXM_API exm_status exm_deformer_positions(const exm_deformer *deformer, int32_t thread_count, float *positions);
EXM_API exm_status exm_deformer_positions_f64(const exm_deformer *deformer, double *positions);

/** The skinning weights in use, [H][V]. EXM_ERROR_ARGUMENT for kinds that have none. */
EXM_API exm_status exm_deformer_weights(const exm_deformer *deformer, float *weights);

EXM_API void exm_deformer_destroy(exm_deformer *deformer);

/* ----------------------------------------------------------------------------------------------------------- AMRAP */

typedef struct exm_amrap_bind_settings {
  size_t struct_size;
  size_t edge_group_count; /* 0: twice the handle count [AMRAP, 5.2] */
  int32_t dimension;       /* 0: 2 where every exemplar lies in the reference's plane, else 3; or 2 or 3 */
  const float *weights;    /* [H][V] or NULL for bounded biharmonic ones; 1 and 0 on handles, >= 0, columns sum to 1 */
} exm_amrap_bind_settings;

EXM_API void exm_amrap_bind_settings_init(exm_amrap_bind_settings *settings);

/**
 * Bind an as-multi-rigid-as-possible deformer [AMRAP, sections 4 and 5].
 *
 * mesh       the reference: its geometry gives the cotangent Laplacian and the handles' reference frames
 * exemplars  [S][V][3] finite
 * handles    2 or more, at least one pinned or oriented on every connected part
 * settings   NULL for the defaults
 * progress   may be NULL
 * out        NULL on failure; release with exm_deformer_destroy
 *
 * Poses are skinned by the weights from affine maps of all exemplars [AMRAP, eq. 6]. Where that has more degrees of
 * freedom than the mesh, H (1 + S d) of at least V, every vertex is free instead, and weights only say which triangles
 * share a rotation and a blend.
 *
 * Memory: O(H V + S V) plus the reduced operators, which do not depend on V.
 * Returns EXM_WARNING_NOT_CONVERGED where its bounded biharmonic weights did not converge; it is usable all the same.
 * Errors: EXM_ERROR_ARGUMENT, EXM_ERROR_UNCONSTRAINED, EXM_ERROR_CANCELLED, EXM_ERROR_OUT_OF_MEMORY,
 * EXM_ERROR_NUMERIC.
 */
EXM_API exm_status exm_amrap_create(const exm_mesh *mesh, const float *exemplars, size_t exemplar_count,
                                    const exm_handles *handles, const exm_amrap_bind_settings *settings,
                                    exm_progress progress, void *user, exm_deformer **out);

typedef enum exm_blend {
  EXM_BLEND_LOCAL = 0, /* blend weights vary over the edge groups [AMRAP, eq. 8] */
  EXM_BLEND_GLOBAL = 1 /* one blend for the whole mesh */
} exm_blend;

typedef enum exm_descent {
  EXM_DESCENT_AUTO = 0,        /* plain, and guarded from the moment that the objective is seen to oscillate */
  EXM_DESCENT_PLAIN = 1,       /* [AMRAP, 5.3-5.5] */
  EXM_DESCENT_TRUST_REGION = 2 /* [AMRAP, appendix A]: no iteration increases the objective */
} exm_descent;

typedef struct exm_amrap_solve_settings {
  size_t struct_size;
  double lambda;      /* >= 0, default 0.5: 0 is a linear shape space, large values jump between exemplars. At 0, of
                         the blends that fit equally, the one closest to the first exemplar is taken */
  int32_t blend;      /* exm_blend */
  int32_t rotations;  /* 1; 0 holds every local rotation at the identity, and the result is the global optimum [5.5] */
  int32_t start;      /* exm_start */
  int32_t descent;    /* exm_descent */
  int32_t iterations; /* of the alternation; 0 chooses: 5 stateless, 1 warm, a cap of 200 with a tolerance */
  double tolerance; /* 0: do just `iterations`, plainly; or stop, with acceleration, when an iteration moves the pose by
                       no more than this share of the mesh's size */
} exm_amrap_solve_settings;

/* With tolerance 0, the default, a stateless result is a continuous function of the targets: it is a fixed number of
 * continuous steps. Fully converged poses are not: where two minima of eq. 10 meet, they jump from one to the other,
 * and the more iterations, the steeper the way between them: five keep a vertex from moving some thirty times as fast
 * as the handle, ten a hundred times, and lower the objective by a third of a percent. */
EXM_API void exm_amrap_solve_settings_init(exm_amrap_solve_settings *settings);

/**
 * Solve for one set of handle targets; read the result with exm_deformer_positions.
 *
 * targets   [H][3][4] finite: rows of [linear part | centre]; the linear part counts for oriented handles and is
 *           relative to the reference pose; rows of free handles are not looked at
 * settings  NULL for the defaults
 * report    may be NULL
 *
 * Returns EXM_WARNING_NOT_CONVERGED where a tolerance was asked for and the cap was reached first; the result is
 * usable. Errors: EXM_ERROR_ARGUMENT, EXM_ERROR_NUMERIC; the deformer keeps its previous result.
 */
EXM_API exm_status exm_amrap_solve(exm_deformer *deformer, const double *targets,
                                   const exm_amrap_solve_settings *settings, exm_solve_report *report);

/** Blend weights of the last solve: [G][S], rows sum to 1 [B of eq. 8]. */
EXM_API exm_status exm_amrap_blend_weights(const exm_deformer *deformer, double *blend);

/** Their average over the edge groups, weighted by surface area: [S], sums to 1. */
EXM_API exm_status exm_amrap_blend_average(const exm_deformer *deformer, double *average);

/** For engineers and tests: what is needed to evaluate eq. 10 on the full mesh. */

/** The edge group of each vertex, [V]. Group g's edge set is made of triangles, each with the share of its corners that
 *  are in g: c_ge = cotangent weight x share. */
EXM_API exm_status exm_amrap_edge_groups(const exm_deformer *deformer, uint32_t *groups);

/** Local rotations that the last objective was evaluated with, [G][S][3][3] row-major [eq. 21]. */
EXM_API exm_status exm_amrap_rotations(const exm_deformer *deformer, double *rotations);

/** Distances of the exemplars from the handle pose, [G][S]: D of eq. 10, not yet square-rooted. Each is a group's share
 *  of E_arap with its factor 1/2 [eq. 7], as E_d has it [eq. 9]: so measured, lambda 0.5 gives figure 2's rows a and b,
 *  piecewise linear; without it weights leave the straight line by 0.07. */
EXM_API exm_status exm_amrap_exemplar_energies(const exm_deformer *deformer, double *energies);

/** The single-exemplar solution that D was measured on, [V][3]. */
EXM_API exm_status exm_amrap_exemplar_positions(const exm_deformer *deformer, size_t exemplar, double *positions);

/* --------------------------------------------------------------------------------------------------------- Blended */

typedef enum exm_dictionary {
  EXM_DICTIONARY_EIGENFUNCTIONS = 0, /* atoms w_j v: w_j the first Laplace-Beltrami eigenfunctions [Blended, 4.1] */
  EXM_DICTIONARY_SKELETON = 1        /* w_j the skinning weights of bones found in the exemplars' motion, and 1 */
} exm_dictionary;

typedef struct exm_blended_bind_settings {
  size_t struct_size;
  int32_t dictionary; /* exm_dictionary of the last stage; the first stages use few eigenfunctions always */
  int32_t dimension;  /* 0: 2 where every exemplar lies in the reference's plane, else 3; or 2 or 3 */
  size_t start_eigenfunction_count; /* m of the first stages, default 4 [Blended, 5]; at least one, the constant */
  size_t eigenfunction_count; /* m of the eigenfunction dictionary, default 15; at least start_eigenfunction_count */
  size_t bone_count;    /* of the skeleton, for rotation clusters too; 0: as many as the exemplars' motion needs */
  size_t cluster_count; /* rotation clusters r; 0: one a bone */
  double atoms_kept;    /* share of a dictionary's atoms that k-medoids leaves, 0..1; default 0.5, 1: all */
  size_t dictionary_exemplar_count; /* atoms of the first so many exemplars only; 0: of all */
  size_t compared_exemplar_count;   /* rigidity against the first so many exemplars only; 0: all */
  const float *weights;     /* [bone_count][V] skinning weights to use instead of a decomposition; NULL: decompose */
  double smoothness;        /* beta_sm [Blended, eq. 10] default 1e-6; >= 0, see exm_blended_set_energies */
  double constraint_weight; /* beta_lc [Blended, eq. 10] default 30; > 0 */
} exm_blended_bind_settings;

EXM_API void exm_blended_bind_settings_init(exm_blended_bind_settings *settings);

/**
 * Bind a deformer of fast blended transformations [Blended, sections 3 and 4]: poses are D T, the dictionary D holding
 * weighted positions of all exemplars. Made for few constraints, big jumps, noise and unknown scale; constraints are
 * met in least squares, not exactly.
 *
 * mesh       the reference: cotangent Laplacian, masses, the handles' reference frames
 * exemplars  [S][V][3] finite. Where each of them lies and how it is turned does not matter
 * handles    as linear constraints H V = Y: a pinned handle is one row, the mean of its vertices; an oriented one also
 *            holds its linear part; a free one adds nothing. At least one pinned or oriented on every connected part
 * settings   NULL for the defaults
 * progress   may be NULL
 * out        NULL on failure; release with exm_deformer_destroy
 *
 * exm_deformer_info: edge_group_count is r, coefficient_count the rank of the last stage's dictionary.
 * Returns EXM_WARNING_EXEMPLARS where exemplars say the same (one is another's rigid copy) or one is turned inside out;
 * EXM_WARNING_UNDERDETERMINED where the handles leave a turn open.
 * Errors: EXM_ERROR_ARGUMENT, EXM_ERROR_UNCONSTRAINED, EXM_ERROR_CANCELLED, EXM_ERROR_OUT_OF_MEMORY,
 * EXM_ERROR_NUMERIC.
 */
EXM_API exm_status exm_blended_create(const exm_mesh *mesh, const float *exemplars, size_t exemplar_count,
                                      const exm_handles *handles, const exm_blended_bind_settings *settings,
                                      exm_progress progress, void *user, exm_deformer **out);

typedef enum exm_blended_begin {
  EXM_BEGIN_SPARSE = 0, /* elastic net [Blended, eq. 23] */
  EXM_BEGIN_PLAIN = 1   /* ridge regression [Blended, eq. 22] */
} exm_blended_begin;

/** The global scale factor alpha [Blended, eq. 7]. */
typedef enum exm_scale {
  EXM_SCALE_HELD = 0,         /* at 1 */
  EXM_SCALE_BALANCED = 1,     /* least E / alpha: distortion counts alike whether exemplar or pose is larger */
  EXM_SCALE_LEAST_SQUARES = 2 /* least E [Blended, eq. 16], which comes out a few percent small where poses differ */
} exm_scale;

/** The schedule of [Blended, 5]: begin, average ARAP and minimal ARAP in the first dictionary, minimal ARAP in the
 *  second. An iteration is a local, a scale and a global step. */
typedef struct exm_blended_solve_settings {
  size_t struct_size;
  double sparsity;            /* beta_sp [Blended, eq. 23] >= 0, default 0.01: fewer atoms in the beginning */
  int32_t begin;              /* exm_blended_begin */
  int32_t scale;              /* exm_scale; default EXM_SCALE_BALANCED */
  int32_t start;              /* exm_start; warm: the last stage alone, from the pose of the last solve */
  int32_t average_iterations; /* eq. 9-11, default 8; 0 leaves the stage out */
  int32_t minimal_iterations; /* eq. 12-14, for each exemplar; at least 1, default 8 */
  int32_t final_iterations;   /* eq. 12-14 in the second dictionary; at least 1; 0 chooses: 12, or 2 when warm */
  double tolerance;           /* 0: do just that many; or end a stage when an iteration lowers its energy by no more
                                 than this share */
  const double *row_targets;  /* [rows][3] Y of the rows added with exm_blended_add_rows, in their order */
} exm_blended_solve_settings;

EXM_API void exm_blended_solve_settings_init(exm_blended_solve_settings *settings);

/**
 * Solve for one set of handle targets; read the result with exm_deformer_positions.
 *
 * targets   [H][3][4] finite: rows of [linear part | centre], as for exm_amrap_solve; rows of free handles and of those
 *           whose weight is 0 are not looked at
 * settings  NULL for the defaults
 * report    may be NULL: objective is the energy of eq. 13 (with EXM_SCALE_BALANCED divided by alpha, seen from the
 *           closest exemplar's size), elastic_energy its part of eq. 7; history runs over all stages, none of which
 *           ever increases it, see exm_blended_outcome for where they begin. constraint_residual is the largest
 * distance of a held centre or row of weight > 0 from its target
 *
 * The result turns, moves and (with scale) grows as the targets do.
 * Returns EXM_WARNING_NOT_CONVERGED with a tolerance; EXM_WARNING_UNDERDETERMINED where targets that count lie in one
 * point or on a line: what they leave open is as in the reference; EXM_WARNING_CONTRADICTORY where rows that are
 * multiples of each other have targets that are not.
 * Errors: EXM_ERROR_ARGUMENT, EXM_ERROR_UNCONSTRAINED (nothing of weight above 0 says where the mesh is),
 * EXM_ERROR_NUMERIC; the deformer keeps its previous result.
 */
EXM_API exm_status exm_blended_solve(exm_deformer *deformer, const double *targets,
                                     const exm_blended_solve_settings *settings, exm_solve_report *report);

/** What the last solve found beside positions. */
typedef struct exm_blended_outcome {
  size_t struct_size;
  double scale;              /* alpha: of the pose against the exemplars */
  size_t exemplar;           /* the one of least energy, [Blended, eq. 12] */
  double average_energy;     /* E_total [Blended, eq. 10] at the end of its stage */
  double minimal_energy;     /* E_mn [Blended, eq. 12] at the end of the first dictionary's stage */
  double final_energy;       /* and of the second's: what tells right correspondences from wrong ones */
  size_t average_history[2]; /* the entries [from, to) of the report's history */
  size_t minimal_history[2]; /* of the chosen exemplar */
  size_t final_history[2];
  size_t begin_atom_count; /* atoms in use at the beginning: rows of T that are not zero */
} exm_blended_outcome;

EXM_API void exm_blended_outcome_init(exm_blended_outcome *outcome);
EXM_API exm_status exm_blended_get_outcome(const exm_deformer *deformer, exm_blended_outcome *outcome);

/** Further linear constraints sum_i coefficients_i v_i = y, in least squares: weighted averages of vertices,
 *  differential coordinates, scan points. */
typedef struct exm_rows {
  size_t count;
  const size_t *offsets; /* [count + 1] from 0: row i owns the terms offsets[i] .. offsets[i + 1], at least one */
  const uint32_t *vertices;
  const double *coefficients;
  const double *weights; /* [count] >= 0, beside 1 of a handle; NULL: all 1 */
} exm_rows;

/** Add rows behind those that are there, by updating the factors. Results stay. */
EXM_API exm_status exm_blended_add_rows(exm_deformer *deformer, const exm_rows *rows);

/** Remove the rows first .. first + count; those behind move up. */
EXM_API exm_status exm_blended_remove_rows(exm_deformer *deformer, size_t first, size_t count);

/** weights [count] >= 0 of the rows first .. first + count; 0 leaves a row out until it is weighed again. */
EXM_API exm_status exm_blended_weigh_rows(exm_deformer *deformer, size_t first, size_t count, const double *weights);

/** weights [H] >= 0 of the handles, at first all 1; 0 for a point that is not seen. NULL: all 1. */
EXM_API exm_status exm_blended_weigh_handles(exm_deformer *deformer, const double *weights);

/** beta_lc > 0 and beta_sm >= 0 of [Blended, eq. 10]; the factors are made anew, which takes milliseconds. Energies are
 *  in the caller's length squared: constraints count as they are, beside the surface's Dirichlet energy; smoothness is
 *  eq. 6 with eigenvalues times the mesh's area and eigenfunctions of mean square 1, so neither depends on scale. */
EXM_API exm_status exm_blended_set_energies(exm_deformer *deformer, double constraint_weight, double smoothness);

typedef struct exm_blended_info {
  size_t struct_size;
  size_t row_count;        /* added with exm_blended_add_rows */
  size_t bone_count;       /* of the skeleton, found or given; 0 where none was needed */
  size_t weight_count;     /* functions of the last stage's dictionary, the constant first */
  size_t start_atom_count; /* b of the first stages' dictionary, after reduction */
  size_t atom_count;       /* b of the last stage's */
  size_t whole_atom_count; /* and before reduction: (1 + dimension S) m */
  double reduction_error;  /* what reduction costs: the largest distance of a dropped atom from the span of those kept,
                              in root mean square over the mesh, as a share of the atom's own */
  double decomposition_error; /* of bones and weights on the exemplars: root mean square distance */
} exm_blended_info;

EXM_API void exm_blended_info_init(exm_blended_info *info);
EXM_API exm_status exm_blended_get_info(const exm_deformer *deformer, exm_blended_info *info);

/** The functions of the last stage's dictionary, [weight_count][V], the constant first: for the skeleton the rest are
 *  skinning weights, which suit vertex groups. */
EXM_API exm_status exm_blended_weights(const exm_deformer *deformer, float *weights);

/** The rotation cluster of each vertex, [V]. */
EXM_API exm_status exm_blended_clusters(const exm_deformer *deformer, uint32_t *clusters);

/** Where the last result has the handles, as targets, [H][3][4]. */
EXM_API exm_status exm_blended_result_pose(const exm_deformer *deformer, double *targets);

/** The last solve's pose as a key for interpolation: an array of exm_blended_key_size doubles. EXM_ERROR_ARGUMENT
 * before the first solve, or where the last result was itself interpolated. */
EXM_API exm_status exm_blended_key_size(const exm_deformer *deformer, size_t *size);
EXM_API exm_status exm_blended_get_key(const exm_deformer *deformer, double *key);

/**
 * Interpolate between keys [Blended, 5, "shape interpolation"]: rotations, scale and place follow curves that are
 * smooth over the whole list, and one global step gives the pose. At a key's time it is the key's pose.
 *
 * keys   [count][size] of exm_blended_get_key of this deformer
 * times  [count] rising
 * time   finite; clamped to the first and the last of them
 *
 * The result is read like a solve's, with exm_deformer_positions and exm_blended_result_pose.
 * Errors: EXM_ERROR_ARGUMENT, EXM_ERROR_OUT_OF_MEMORY; the deformer keeps its previous result.
 */
EXM_API exm_status exm_blended_interpolate(exm_deformer *deformer, const double *keys, const double *times,
                                           size_t count, double time);

/* -------------------------------------------------------------------------------------------------------- Rigidity */

/** The widest neighbourhood, in rings. */
#define EXM_RADIUS_MAX 64

typedef struct exm_rigidity_bind_settings {
  size_t struct_size;
  const int32_t *radii; /* [V] r of each vertex, 1..EXM_RADIUS_MAX, copied; NULL: `radius` everywhere */
  int32_t radius;       /* default 1: Sorkine and Alexa's as-rigid-as-possible */
  double handle_size;   /* share of the mesh's diagonal, default 0.03: a handle smaller than that has a disc of that
                           radius about it which resists bending the more the closer it is, so that a single vertex
                           draws a rounded bump and no spike. 0: eq. 1 as it is, where single vertices draw cusps */
} exm_rigidity_bind_settings;

EXM_API void exm_rigidity_bind_settings_init(exm_rigidity_bind_settings *settings);

/**
 * Bind a rigidity-controllable deformer [Rigidity]: every vertex moves by itself, and every vertex k has one rotation
 * for the edges N(k, r_k) that leave the vertices within r_k - 1 edges of k. What is minimised is eq. 1,
 *
 *   E = sum_k sum_((i,j) in N(k, r_k)) w_ij |(p'_i - p'_j) - R_k (p_i - p_j)|^2,
 *
 * plus the handles' discs, if any. Larger r is stiffer. The weights w_ij are eq. 2's, where negative cotangents count
 * as 0, corner by corner: so no neighbourhood gains by being torn, and E is never negative. Degenerate triangles hold
 * their corners together weakly.
 *
 * handles   1 or more, at least one pinned or oriented on every connected part.
 *           Pinned: the centre of its vertices is held; where it has vertices on several connected parts, the centre of
 *           each share of them is. Oriented: every one of its vertices is held, at the place that the affine frame
 * takes it to; where they span no area, with as many surrounding rings as are needed, but for vertices of others. Free:
 * ignored. settings  NULL for the defaults progress  may be NULL out       NULL on failure; release with
 * exm_deformer_destroy. Its one exemplar is the reference.
 *
 * Memory: O(V r) beside the factor, and O(V) for each pinned handle of several vertices.
 * Errors: EXM_ERROR_ARGUMENT, EXM_ERROR_UNCONSTRAINED, EXM_ERROR_CANCELLED, EXM_ERROR_OUT_OF_MEMORY,
 * EXM_ERROR_NUMERIC.
 */
EXM_API exm_status exm_rigidity_create(const exm_mesh *mesh, const exm_handles *handles,
                                       const exm_rigidity_bind_settings *settings, exm_progress progress, void *user,
                                       exm_deformer **out);

/** Other radii for a bound deformer: neighbourhoods are collected anew and the matrix is factored, but not analysed.
 *  The last result stays, and a warm solve goes on from it. radii [V], or NULL for `radius` everywhere.
 *  Errors: as for create; the deformer keeps the radii it had. */
EXM_API exm_status exm_rigidity_set_radii(exm_deformer *deformer, const int32_t *radii, int32_t radius,
                                          exm_progress progress, void *user);

/** Other handles for a bound deformer, which keeps its neighbourhoods and the analysis of its matrix; the rest as
 * above. The handle count of exm_deformer_info changes with it. */
EXM_API exm_status exm_rigidity_set_handles(exm_deformer *deformer, const exm_handles *handles, exm_progress progress,
                                            void *user);

/** The radii in use, [V]. */
EXM_API exm_status exm_rigidity_get_radii(const exm_deformer *deformer, int32_t *radii);

typedef struct exm_rigidity_solve_settings {
  size_t struct_size;
  int32_t start;          /* exm_start; default EXM_START_STATELESS: all rotations are the identity, as in the paper;
                             EXM_START_WARM, EXM_START_POSITIONS */
  const float *positions; /* [V][3] to start from with EXM_START_POSITIONS: another deformer's result, say */
  double tolerance;       /* default 1e-3: stop when an iteration takes less than this share off the energy [3.2.3];
                             0: do just `iterations` */
  int32_t iterations;     /* cap; 0 chooses 1000, or 10 without a tolerance */
  int32_t acceleration;   /* default 1: Anderson acceleration, each step of which is checked against the energy;
                             0: local and global steps alone, as in the paper */
  int32_t coarse_start;   /* stateless solves begin with rotations of a coarser mesh, solved first, and warm ones turn
                             their rotations as it turns: default -1: from 5000 vertices on; 0: never; 1: always */
  int32_t thread_count;   /* 0: chosen. The result is the same for any */
} exm_rigidity_solve_settings;

EXM_API void exm_rigidity_solve_settings_init(exm_rigidity_solve_settings *settings);

/**
 * Solve for one set of handle targets; read the result with exm_deformer_positions. Nothing is factored. No iteration
 * increases the energy.
 *
 * targets   [H][3][4] as for exm_amrap_solve
 * settings  NULL for the defaults
 * report    may be NULL; objective and elastic_energy are E, in the unit of length squared; history is E after each
 *           iteration
 *
 * Returns EXM_WARNING_NOT_CONVERGED where the cap was reached before the tolerance; the result is usable.
 * Errors: EXM_ERROR_ARGUMENT, EXM_ERROR_NUMERIC (numbers too large); the deformer keeps its previous result.
 */
EXM_API exm_status exm_rigidity_solve(exm_deformer *deformer, const double *targets,
                                      const exm_rigidity_solve_settings *settings, exm_solve_report *report);

/** The rotation of every vertex's neighbourhood in the last result, [V][3][3] row-major. */
EXM_API exm_status exm_rigidity_rotations(const exm_deformer *deformer, double *rotations);

/** The energy of every vertex's neighbourhood in the last result, [V]: the summands of eq. 1 over k. */
EXM_API exm_status exm_rigidity_energies(const exm_deformer *deformer, double *energies);

typedef struct exm_rigidity_learn_settings {
  size_t struct_size;
  int32_t radius_min; /* default 1 */
  int32_t radius_max; /* default 6 */
  double omega;       /* default 0.3: what one ring more is worth, in E_ARAP, which has no unit */
} exm_rigidity_learn_settings;

EXM_API void exm_rigidity_learn_settings_init(exm_rigidity_learn_settings *settings);

/**
 * Radii from poses [Rigidity, 3.4]: where all poses are rigid over many rings r is large, where they bend it is small.
 * For each vertex k the r in radius_min..radius_max of least E_ARAP(k, r) + omega (radius_max - r), the larger of equal
 * ones. E_ARAP(k, r) is the energy of N(k, r) in its best rotation, over the Voronoi area of the vertices within r
 * edges of k, averaged over the poses. It does not depend on the scale of mesh and poses, if that is one.
 *
 * mesh      the reference
 * poses     [M][V][3] finite, 1 or more, the reference itself not among them
 * settings  NULL for the defaults
 * progress  may be NULL
 * radii     [V] out
 * energies  [radius_max - radius_min + 1][V] out, E_ARAP by r; may be NULL
 *
 * Errors: EXM_ERROR_ARGUMENT, EXM_ERROR_CANCELLED, EXM_ERROR_OUT_OF_MEMORY.
 */
EXM_API exm_status exm_rigidity_learn(const exm_mesh *mesh, const float *poses, size_t pose_count,
                                      const exm_rigidity_learn_settings *settings, exm_progress progress, void *user,
                                      int32_t *radii, double *energies);
/* -------------------------------------------------------------------------------------------------------- sequence */

/**
 * A deforming mesh sequence as three signals that can be edited apart [SEQ, eq. 1]:
 *
 *   time  f: frames -> plane      a cubic B-spline curve of k control points in the pose plane
 *   pose  g: plane -> R^m         a thin-plate spline over l sites
 *   shape h: R^m -> shape space   a mean shape and m components
 *
 * Frame i of the n that were given is at time i, 0 to n - 1; times are real numbers, in frames. A sequence is made of a
 * mesh and frames, fitted, and then edited, sampled or saved. Long sequences may be fitted in overlapping windows of
 * frames, each with a pose plane and a curve of its own, joined smoothly; the shape signal is one. Functions about the
 * plane and the curve name a window: 0, where nobody asked for more.
 */
typedef struct exm_sequence exm_sequence;

/** What the shape signal is linear in [SEQ, section 5], and of how many numbers. 6 and 3 count for every connected part
 *  of the mesh, E edges. Coordinates are scaled so that errors and distances compare with those of positions. */
typedef enum exm_shape_space {
  EXM_SHAPE_POSITIONS = 0,                 /* vertex coordinates, 3 V */
  EXM_SHAPE_GRADIENTS = 1,                 /* deformation gradients: rotation and stretch of triangles, 9 F + 3 */
  EXM_SHAPE_LINEAR_ROTATION_INVARIANT = 2, /* discrete forms, 3 E + 6; the mesh must be manifold */
  EXM_SHAPE_LENGTHS_ANGLES = 3,            /* edge lengths and dihedral angles, 2 E + 6 */
  EXM_SHAPE_PATCHES = 4                    /* gradients relative to patches, those to each other: 9 F, 3 a pair, 6 */
} exm_shape_space;

/**
 * A sequence without frames. The mesh is copied: it gives the triangles and the reference shape.
 *
 * shape_space  exm_shape_space
 * out          NULL on failure; release with exm_sequence_destroy
 */
EXM_API exm_status exm_sequence_create(const exm_mesh *mesh, int32_t shape_space, exm_sequence **out);

EXM_API void exm_sequence_destroy(exm_sequence *sequence);

/**
 * Append a frame, which is copied (4 bytes a coordinate). Frames are handed over one by one so that nobody has to hold
 * all of them twice. A fit that was made stays as it is until the next one.
 *
 * positions       [vertex_count][3] finite
 * vertex_count    that of the mesh, or the frame is refused
 * triangles       [triangle_count][3] of this frame, to have a change of connectivity noticed; NULL: not looked at
 */
EXM_API exm_status exm_sequence_add_frame(exm_sequence *sequence, const float *positions, size_t vertex_count,
                                          const uint32_t *triangles, size_t triangle_count);

/** Release the frames of a fitted sequence. Evaluation and edits do not need them; fitting and measuring do. */
EXM_API exm_status exm_sequence_drop_frames(exm_sequence *sequence);

/** Frames held in given places of the pose plane while multidimensional scaling places the others [SEQ, 3.2.1].
 *  No two of them at one point. The plane's unit is the length of a difference of shapes: see exm_sequence_get_frames.
 */
typedef struct exm_pins {
  size_t count;
  const uint32_t *frames;  /* [count] distinct */
  const double *positions; /* [count][2] finite */
} exm_pins;

typedef struct exm_sequence_fit_settings {
  size_t struct_size;
  /* Signal fidelity [SEQ, 3.4]; 0: as few as the tolerance allows. Counts above their upper limits mean these limits,
   * at which every frame is reproduced to rounding: k = n + 2 (n where cyclic), l = n, m = n - 1. */
  size_t control_point_count; /* k, 4 or more */
  size_t site_count;          /* l, 3 or more */
  size_t component_count;     /* m, at least 1 */
  double tolerance; /* > 0: for the counts left at 0, the RMS distance of the vertices from where the frames have
                       them, as a share of the diagonal of the mesh's bounding box; default 1e-3 */
  int32_t cyclic;   /* 1: the last frame is followed by the first, one frame later; the curve is closed */
  exm_pins pins;    /* count 0: none; a window takes those of its frames */
  /* Shapes that span the shape signal instead of principal components; component_count is not looked at. */
  const float *examples; /* [example_count][V][3] finite, 2 or more; NULL: none */
  size_t example_count;
  /* 1: try layouts in which frames are not squeezed against others that do not follow them, and keep the one of the
   * smallest acceleration between frames; takes some 24 times as long. Default 0 */
  int32_t cure_saddles;
  /* Frames a window, 8 or more, and how many of them it shares with the next one, 2 to half of them (0: a quarter); the
   * counts above are those of a window. 0: one window. Not for cyclic sequences. Over shared frames one window's shapes
   * give way to the next one's, smoothly. */
  size_t window_size, window_overlap;
} exm_sequence_fit_settings;

EXM_API void exm_sequence_fit_settings_init(exm_sequence_fit_settings *settings);

typedef struct exm_sequence_fit_report {
  size_t struct_size;
  size_t control_point_count; /* of the windows together */
  size_t site_count;          /* those that count: of sites at one place, one; of the windows together */
  size_t component_count;
  double diagonal; /* of the mesh's bounding box */
  /* RMS distances as shares of the diagonal, as explained under tolerance. */
  double shape_error; /* of h alone [SEQ, eq. 3] */
  double pose_error;  /* of g and h [SEQ, eq. 4] */
  double error;       /* of f, g and h together [SEQ, eq. 2] */
  double stress;      /* of the layout of the frames in the plane, normalised: root of [SEQ, eq. 6] over the sum of
                         squared distances in R^m */
  double seconds;
  /* Of exm_sequence_fit; exm_sequence_place leaves them 0. */
  size_t saddle_count; /* intervals between frames in whose middle the surface of poses bends one way along the curve
                          and the other way across [SEQ, 3.2.1] */
  double acceleration; /* the largest between frames: RMS of the vertices per frame^2, as a share of the diagonal */
} exm_sequence_fit_report;

EXM_API void exm_sequence_fit_report_init(exm_sequence_fit_report *report);

/**
 * Fit the three signals to the frames [SEQ, section 3]: principal components from the Gram matrix of the frames, multi-
 * dimensional scaling by stress majorisation, sites chosen greedily (their order does not depend on l: sets are
 * nested), centripetal parameters, least squares, and a monotone interpolant between frames and parameters.
 *
 * frames    3 or more, not all the same
 * settings  NULL for the defaults
 * progress  may be NULL
 * report    may be NULL
 *
 * Memory: the frames, n x n, and m components. Frames that repeat each other are fine.
 * Errors: EXM_ERROR_ARGUMENT (too few frames, nothing moves, pins that coincide, counts below their lower limits),
 * EXM_ERROR_CANCELLED, EXM_ERROR_OUT_OF_MEMORY, EXM_ERROR_NUMERIC. The last fit then stays in place.
 */
EXM_API exm_status exm_sequence_fit(exm_sequence *sequence, const exm_sequence_fit_settings *settings,
                                    exm_progress progress, void *user, exm_sequence_fit_report *report);

typedef struct exm_sequence_info {
  size_t struct_size;
  size_t vertex_count;
  size_t triangle_count;
  size_t held_frame_count; /* added and not dropped */
  size_t dimension;        /* d of the shape space */
  int32_t shape_space;
  int32_t is_fitted;
  /* Of a fitted sequence; 0 before. */
  int32_t cyclic;
  size_t window_count;
  size_t frame_count;     /* n of the time signal: edits of it can change it. Times are 0 to n - 1; cyclic: 0 to n */
  size_t component_count; /* m */
} exm_sequence_info;

EXM_API void exm_sequence_info_init(exm_sequence_info *info);
EXM_API exm_status exm_sequence_get_info(const exm_sequence *sequence, exm_sequence_info *info);

typedef struct exm_sequence_window {
  size_t struct_size;
  size_t first_frame; /* that the window covers, and how many of them */
  size_t frame_count;
  size_t control_point_count; /* k */
  size_t knot_count;          /* k + 2; cyclic: k + 1, the last of which repeats the first, one period later */
  size_t site_count;          /* l */
  size_t fitted_frame_count;  /* frames that the pose signal was fitted to: marks in the plane */
} exm_sequence_window;

EXM_API void exm_sequence_window_init(exm_sequence_window *window);
EXM_API exm_status exm_sequence_get_window(const exm_sequence *sequence, size_t window, exm_sequence_window *out);

/* Sampling. The functions from here to the files ask for a fitted sequence and say so where it is not. */

/**
 * The shape at a time. Frames' times give what the frames were fitted to; before the first and after the last frame,
 * that frame is held; a cyclic sequence goes on for ever.
 *
 * time       finite, in frames
 * positions  [V][3] out
 */
EXM_API exm_status exm_sequence_evaluate(exm_sequence *sequence, double time, float *positions);
EXM_API exm_status exm_sequence_evaluate_f64(exm_sequence *sequence, double time, double *positions);

/** The order-th derivative of the positions in time, [V][3] in units per frame^order; order 1 or 2. The first is
 *  continuous. The second is the difference of the first a hundredth of a frame to either side: a thin plate's
 * curvature is unbounded at its sites, and the time signal's jumps at frames. Zero where a frame is held. */
EXM_API exm_status exm_sequence_derivative(exm_sequence *sequence, double time, int32_t order, double *derivative);

/** The shape at any point of a window's pose plane. point [2] finite; positions [V][3] out. */
EXM_API exm_status exm_sequence_pose(exm_sequence *sequence, size_t window, const double *point, float *positions);

/** Where the curve is at a time that the window covers (others are moved to its ends): point [2] out. */
EXM_API exm_status exm_sequence_curve(const exm_sequence *sequence, size_t window, double time, double *point);

/** RMS and largest distance of the vertices from those of the held frames, as shares of report->diagonal, frame by
 *  frame: rms [n] and largest [n], either may be NULL. Only while the time signal has as many frames as are held. */
EXM_API exm_status exm_sequence_measure(exm_sequence *sequence, double *rms, double *largest);

/* The pose plane. Its origin and orientation are those of the first two principal components unless frames are pinned;
 * its unit is such that distances are those of shapes in R^m, divided by the root of V: the RMS way of a vertex in the
 * caller's unit of length (in shape spaces other than positions: scaled to compare with it). */

/** What the marks show. positions [n][2]: where the pose signal has the frames it was fitted to; parameters [n'] of
 *  the time signal's frames on the curve, in its knots' unit (n' is frame_count of the window); pinned [n] 1 or 0.
 *  Each may be NULL. */
EXM_API exm_status exm_sequence_get_frames(const exm_sequence *sequence, size_t window, double *positions,
                                           double *parameters, int32_t *pinned);

/** The sites in the order they were chosen, by their number among the fitted frames of the window: sites [l]. */
EXM_API exm_status exm_sequence_get_sites(const exm_sequence *sequence, size_t window, uint32_t *sites);

/**
 * Pin frames, let the others relax from where they are, and fit pose and time signals again, with as many sites and
 * control points as before; the shape signal stays. What a user interface calls while a mark is dragged: it does not
 * look at the mesh. Edits of the curve are lost.
 *
 * pins        all of them, also those of earlier calls that are to stay; frames of the whole sequence
 * iterations  of the scaling at most; 0: until it has settled
 */
EXM_API exm_status exm_sequence_place(exm_sequence *sequence, const exm_pins *pins, int32_t iterations,
                                      exm_sequence_fit_report *report);

/* The curve. An edit of it changes nothing outside of its support, not by a bit: the spans that the control points take
 * part in and, where a knot comes or goes, two spans on either side of it. */

/** points [k][2], knots [k + 2] rising from 0 at the beginning of the curve (the first ones negative or 0); either may
 *  be NULL. */
EXM_API exm_status exm_sequence_get_curve(const exm_sequence *sequence, size_t window, double *points, double *knots);

/** Move control points first .. first + count - 1. points [count][2] finite. */
EXM_API exm_status exm_sequence_move_control_points(exm_sequence *sequence, size_t window, size_t first, size_t count,
                                                    const double *points);

/**
 * Insert a control point that becomes number `index`, between 1 and k - 1 (cyclic: 0 to k - 1), and a knot with it.
 *
 * point  [2] where it goes, the others staying where they are; NULL: by knot insertion, which leaves the curve as it is
 *        and moves its neighbours.
 */
EXM_API exm_status exm_sequence_insert_control_point(exm_sequence *sequence, size_t window, size_t index,
                                                     const double *point);

/** Delete one control point and a knot; 4 must be left. */
EXM_API exm_status exm_sequence_delete_control_point(exm_sequence *sequence, size_t window, size_t index);

/**
 * Replace the time signal by a drawn curve [SEQ, 4.4]: with poses added as frames and all of them pinned, this makes an
 * animation from nothing.
 *
 * points       [k][2] finite
 * knots        [k + 2], not falling, the curve's range [2 .. k - 1] not empty (cyclic: [k + 1]); NULL: uniform
 * frame_count  2 or more frames (cyclic: 1 or more), at equal steps of the parameter from one end to the other
 *
 * Errors: EXM_ERROR_ARGUMENT (k below 4, more windows than one).
 */
EXM_API exm_status exm_sequence_draw(exm_sequence *sequence, size_t control_point_count, const double *points,
                                     const double *knots, size_t frame_count);

/* The frames' times. These edits replace the frames of the time signal, whose curve or rate changes; the times of later
 * calls are those of the new frames. They ask for a single window. */

/**
 * Other frames on the same curve [SEQ, 4.2]: new frame j is what was at times[j], to the bit.
 *
 * times  [count] finite, not falling, within 0 .. n - 1; cyclic: over less than n frames
 */
EXM_API exm_status exm_sequence_resample(exm_sequence *sequence, const double *times, size_t count);

/** `ratio` > 0 times as many frames a second, at the same speed: new frame j is at time j / ratio. A cyclic sequence
 * gets the nearest whole number of frames, evenly spread. */
EXM_API exm_status exm_sequence_convert_rate(exm_sequence *sequence, double ratio);

/**
 * Play the stretch between two times again, `count` times more [SEQ, 4.1 and figure 5]: its control points and frames
 * are repeated, and the curve goes back from its end to its beginning by a smooth bend of three spans. What lies before
 * that bend and two spans after the stretch's last repetition does not change by a bit; later frames just come later.
 *
 * from, to  frames' times, from < to, and a knot between them
 */
EXM_API exm_status exm_sequence_loop(exm_sequence *sequence, double from, double to, size_t count);

/**
 * Put a shape into the pose plane: the pose signal passes through it there (to a part in 1e5 of what it was away), and
 * bends around it; places of frames and the curve stay. It is counted behind the fitted frames, and pinned.
 *
 * positions  [V][3] finite
 * point      [2] finite, where no other pose is
 *
 * Asks for a single window. The shape may be outside of the space of the components: it brings another one.
 */
EXM_API exm_status exm_sequence_add_pose(exm_sequence *sequence, const float *positions, const double *point);

/**
 * The same motion on another mesh, of any connectivity [SEQ, 4.3]: the shape signal is replaced by matched examples,
 * pose and time signals stay as they are, edits included. Every shape is written as source example 0 plus a combination
 * of the others' differences to it, in least squares, and shown as that combination of the target's.
 *
 * source_examples  [count][V][3] finite; 0 is the reference pose
 * target           mesh of V' vertices; copied
 * shape_space      exm_shape_space of the new sequence
 * target_examples  [count][V'][3] finite, the same poses
 * count            2 or more
 * out              NULL on failure; release with exm_sequence_destroy. It holds no frames
 */
EXM_API exm_status exm_sequence_transfer(exm_sequence *sequence, const float *source_examples, const exm_mesh *target,
                                         int32_t shape_space, const float *target_examples, size_t count,
                                         exm_sequence **out);

/* Files. docs/sequences.md describes the format, version EXM_SEQUENCE_FILE_VERSION. */

#define EXM_SEQUENCE_FILE_VERSION 1

typedef struct exm_sequence_file_report {
  size_t struct_size;
  uint64_t file_size;   /* bytes */
  uint64_t frames_size; /* of the frames that it stands for: n V 3 single precision numbers */
  double ratio;         /* frames_size / file_size */
} exm_sequence_file_report;

EXM_API void exm_sequence_file_report_init(exm_sequence_file_report *report);

/**
 * Save a fitted sequence: mesh and signals, not the frames. The file is written beside `path` and renamed when it is
 * whole, so that a failure (a full disk) leaves what was there before. report may be NULL.
 *
 * Errors: EXM_ERROR_ARGUMENT (not fitted), EXM_ERROR_IO, EXM_ERROR_OUT_OF_MEMORY.
 */
EXM_API exm_status exm_sequence_save(const exm_sequence *sequence, const char *path, exm_sequence_file_report *report);

/**
 * Load what exm_sequence_save wrote; evaluates to the same bits. Every number is checked before it is used.
 *
 * report  may be NULL
 * out     NULL on failure; release with exm_sequence_destroy
 *
 * Errors: EXM_ERROR_IO (not such a file, another version, cut short, damaged), EXM_ERROR_OUT_OF_MEMORY.
 */
EXM_API exm_status exm_sequence_load(const char *path, exm_sequence_file_report *report, exm_sequence **out);

/* ------------------------------------------------------------------------------------------------------------ scan */

/** What a registration fits to: a triangle mesh of any connectivity, or a cloud of points; whole or with holes, in one
 *  piece or several, of any scale, anywhere. Holds an index of nearest points, normals and boundaries. */
typedef struct exm_scan exm_scan;

/** In place of an index: nothing there corresponds. */
#define EXM_UNSEEN UINT32_MAX

typedef struct exm_scan_settings {
  size_t struct_size;
  const uint32_t *triangles; /* [F][3] 0-based; NULL: a cloud of points. Repeated corners are passed over */
  size_t triangle_count;
  const float *normals;  /* [P][3] of any length, zero where unknown; NULL: from triangles, or estimated from
                            `neighbor_count` nearest points, and then of unknown sign */
  size_t neighbor_count; /* default 12, at least 4; more for noise */
} exm_scan_settings;

EXM_API void exm_scan_settings_init(exm_scan_settings *settings);

/**
 * A scan from arrays, which are copied.
 *
 * points    [P][3] finite, at least 4, of some extent
 * settings  NULL: a cloud of points
 * out       NULL on failure; release with exm_scan_destroy
 *
 * Errors: EXM_ERROR_ARGUMENT, EXM_ERROR_TOPOLOGY (an index out of range), EXM_ERROR_OUT_OF_MEMORY.
 */
EXM_API exm_status exm_scan_create(const float *points, size_t point_count, const exm_scan_settings *settings,
                                   exm_scan **out);

/** The same from a file: OBJ, PLY, OFF or STL. A file without faces is a cloud. Also EXM_ERROR_IO. */
EXM_API exm_status exm_scan_read(const char *path, exm_scan **out);

EXM_API void exm_scan_destroy(exm_scan *scan);

typedef struct exm_scan_report {
  size_t struct_size;
  size_t point_count;
  size_t triangle_count;
  size_t boundary_point_count; /* points at the rim of the scan: there it was cut off, the surface goes on */
  int32_t signed_normals;      /* 1: normals point outward, by triangles or as given; 0: of unknown sign */
  double diagonal;             /* of the bounding box */
  double spacing;              /* root mean square distance of points from their nearest neighbours */
} exm_scan_report;

EXM_API void exm_scan_report_init(exm_scan_report *report);
EXM_API exm_status exm_scan_get_report(const exm_scan *scan, exm_scan_report *report);

/** points [P][3], triangles [F][3], normals [P][3] of length 1 or 0, boundary [P] 0 or 1; each may be NULL. */
EXM_API exm_status exm_scan_get_arrays(const exm_scan *scan, float *points, uint32_t *triangles, float *normals,
                                       uint8_t *boundary);

/** The scan's point nearest to each of the queries [count][3] finite: indices [count] out, distances [count] out;
 * either may be NULL. */
EXM_API exm_status exm_scan_nearest(const exm_scan *scan, const double *queries, size_t count, uint32_t *indices,
                                    double *distances);

/* ---------------------------------------------------------------------------------------------------- registration */

/**
 * A mesh and its exemplars, ready to be fitted to scans [Blended, section 5, from "Automatic feature point
 * correspondence" on]: create once, fit many scans.
 */
typedef struct exm_registration exm_registration;

/**
 * mesh       the shape that is fitted
 * exemplars  [S][V][3] finite; poses that span what the scan may show. Where they lie and how they are turned does not
 *            matter
 * settings   of the dictionary, as for exm_blended_create; `dimension` is not looked at. NULL for the defaults
 * progress   may be NULL
 * out        NULL on failure; release with exm_registration_destroy. The mesh need not live
 *
 * Returns and errors: as for exm_blended_create.
 */
EXM_API exm_status exm_registration_create(const exm_mesh *mesh, const float *exemplars, size_t exemplar_count,
                                           const exm_blended_bind_settings *settings, exm_progress progress, void *user,
                                           exm_registration **out);

EXM_API void exm_registration_destroy(exm_registration *registration);

/**
 * Points of the scan that are known on the mesh.
 *
 * vertices  [count] of the mesh, distinct
 * points    [count][3] finite; on the scan or close to it
 * weights   [count] >= 0; NULL: all 1. Those of weight 0 are not looked at
 */
typedef struct exm_landmarks {
  size_t count;
  const uint32_t *vertices;
  const double *points;
  const double *weights;
} exm_landmarks;

typedef struct exm_registration_match_settings {
  size_t struct_size;
  int32_t scale;      /* 1: unknown, default; 0: that of the exemplars times known_scale */
  double known_scale; /* default 1; > 0 */
  double margin;      /* default 0.2: below this relative margin the answer comes with a warning */
} exm_registration_match_settings;

EXM_API void exm_registration_match_settings_init(exm_registration_match_settings *settings);

typedef struct exm_registration_match_report {
  size_t struct_size;
  double energy;      /* of the assignment found, [Blended, eq. 12] */
  double second;      /* of the next best one; infinite where there is none */
  double margin;      /* (second - energy) / second: 0 ambiguous, 1 certain */
  int32_t mirrored;   /* 1: the next best is a mirror image: it differs by a left-right flip of the whole set */
  size_t permissible; /* assignments there are */
  size_t solved;      /* those whose energy was computed; the rest were excluded by bounds */
  double seconds;
} exm_registration_match_report;

EXM_API void exm_registration_match_report_init(exm_registration_match_report *report);

/**
 * Which landmark is which [Blended, 5, figure 3]: among all permissible assignments of points to vertices the one whose
 * pose has the least deformation energy. Branch and bound: an assignment begun is given up where the distances between
 * its points already cost more than a whole one that was found.
 *
 * landmarks  at least 4, in any assignment
 * groups     [count]: points of landmarks with one and the same label 0 or above may change places; below 0: certain
 * settings   NULL for the defaults
 * progress   may be NULL
 * order      [count] out: the point of vertices[i] is points[order[i]]
 * second     [count] out, the next best assignment; may be NULL
 * report     may be NULL
 *
 * Returns EXM_WARNING_AMBIGUOUS where the margin is below settings.margin: show both to the user.
 * Errors: EXM_ERROR_ARGUMENT, EXM_ERROR_UNCONSTRAINED (fewer than four points, or all on a line), EXM_ERROR_CANCELLED,
 * EXM_ERROR_OUT_OF_MEMORY, EXM_ERROR_NUMERIC.
 */
EXM_API exm_status exm_registration_match(exm_registration *registration, const exm_landmarks *landmarks,
                                          const int32_t *groups, const exm_registration_match_settings *settings,
                                          exm_progress progress, void *user, uint32_t *order, uint32_t *second,
                                          exm_registration_match_report *report);

/* Lengths in shares are of the mesh's size: the root of the area of its reference, times the scale that is found. */
typedef struct exm_registration_fit_settings {
  size_t struct_size;
  int32_t scale;       /* 1: unknown, default; 0: that of the exemplars times known_scale */
  double known_scale;  /* default 1; > 0 */
  int32_t start;       /* exm_start; default EXM_START_STATELESS: from the landmarks. EXM_START_WARM: from the last fit,
                          for sequences of scans; landmarks may then be few or none */
  double disc_radius;  /* default 0.15, a share: landmarks are averages over geodesic discs of up to this radius on
                          mesh and scan [Blended, 5], as far as the scan is whole there; 0: points */
  size_t disc_count;   /* default 10; at least 1 */
  int32_t iterations;  /* of non-rigid ICP; default 20; 0: landmarks only */
  size_t sample_count; /* vertices, and as many points of the scan, that ICP looks at; default 1000 */
  double reach;        /* default 0.15, a share: correspondences farther apart are rejected, at first; the reach
                          shrinks to what residuals say */
  double max_angle;    /* default 60 degrees: normals that differ by more do not correspond */
  double tightness; /* default 1, > 0: how much the scan's points count in the end, beside the deformation's energy */
  double landmark_share; /* default 0.1, >= 0: how much landmarks count in the end, beside the scan's points */
  int32_t finish;        /* 1, default: every vertex moves by itself at last, as rigidly as possible, towards the scan
                            where it is seen; 0: the pose stays in the dictionary's span */
  double detail;         /* default 1, > 0: how much seen points count in the finish, beside rigidity. Less for noise */
  int32_t thread_count;  /* 0: chosen. The result is the same for any */
  int32_t reject_landmarks; /* 1, default: of six or more, those that contradict all others are left out, with a
                               warning; 0: none is */
} exm_registration_fit_settings;

EXM_API void exm_registration_fit_settings_init(exm_registration_fit_settings *settings);

typedef struct exm_registration_fit_report {
  size_t struct_size;
  double quality;  /* 0..1: share of the scan that the shape explains, before the finish: points that lie within 0.02 (a
                      share) of it and agree in normal. Below 0.5 the fit comes with a warning: the scan shows something
                      else, or landmarks are wrong */
  double scale;    /* of the result against the exemplars */
  size_t exemplar; /* the one that rigidity was measured against in the end */
  double seen;     /* share of the mesh's area that has a counterpart on the scan */
  double residual; /* root mean square distance of the scan's points from the surface, of those that correspond; in the
                      caller's unit */
  double landmark_residual; /* root mean square distance of landmarks after the fit */
  size_t worst_landmark;    /* index of the one that fits worst */
  double worst_residual;    /* its distance */
  double energy;            /* [Blended, eq. 13] of the pose before the finish, with the mesh's diagonal as the unit of
                               length: how far it is from every exemplar. Above 0.05 the fit comes with a warning */
  int32_t iterations;
  int32_t converged; /* 1: correspondences had settled before the cap */
  double seconds;
  double start_seconds, icp_seconds, finish_seconds, match_seconds; /* its parts */
  size_t rejected_count; /* landmarks that contradict all others and were left out; the one with the largest distance
                            is worst_landmark */
} exm_registration_fit_report;

EXM_API void exm_registration_fit_report_init(exm_registration_fit_report *report);

/**
 * Fit the mesh to a scan [Blended, 5, "Shape completion and registration"]: the pose in the exemplars' space that meets
 * the landmarks, then non-rigid ICP over the dictionary, then the finish.
 *
 * landmarks  at least three that count and are not on a line, unless the start is warm; NULL: none
 * settings   NULL for the defaults
 * progress   may be NULL. While it is called exm_registration_positions gives the shape so far
 * report     may be NULL
 *
 * Returns EXM_WARNING_FIT where the result is doubtful, with a sentence that says why: low quality, or a landmark that
 * contradicts all others.
 * Errors: EXM_ERROR_ARGUMENT (a landmark out of range, not finite, far outside of the scan), EXM_ERROR_UNCONSTRAINED
 * (too few landmarks, or on a line), EXM_ERROR_CANCELLED, EXM_ERROR_OUT_OF_MEMORY, EXM_ERROR_NUMERIC. On failure the
 * last fit stays.
 */
EXM_API exm_status exm_registration_fit(exm_registration *registration, const exm_scan *scan,
                                        const exm_landmarks *landmarks, const exm_registration_fit_settings *settings,
                                        exm_progress progress, void *user, exm_registration_fit_report *report);

/** The fitted shape, [V][3]; the reference before the first fit. */
EXM_API exm_status exm_registration_positions(const exm_registration *registration, float *positions);

/** For every vertex of the mesh the scan's point that it corresponds to, or EXM_UNSEEN: points [V] out; and its
 * distance from the scan's surface, NaN where unseen: distances [V] out. Either may be NULL. */
EXM_API exm_status exm_registration_vertex_matches(const exm_registration *registration, uint32_t *points,
                                                   float *distances);

/**
 * For every point of the scan that was fitted last the place on the mesh that it corresponds to. Each may be NULL.
 *
 * vertices     [P] out: the nearest vertex, or EXM_UNSEEN
 * triangles    [P] out: the triangle, or EXM_UNSEEN
 * barycentric  [P][3] out: weights of its corners
 * distances    [P] out: distance from the fitted surface, of unseen points as well
 */
EXM_API exm_status exm_registration_scan_matches(const exm_registration *registration, uint32_t *vertices,
                                                 uint32_t *triangles, float *barycentric, float *distances);

/** Distances of the last fit's landmarks from their points, [count] in their order; NaN for those of weight 0. */
EXM_API exm_status exm_registration_landmark_residuals(const exm_registration *registration, double *residuals);

typedef struct exm_registration_info {
  size_t struct_size;
  size_t vertex_count;
  size_t exemplar_count;
  size_t atom_count;     /* of the richest dictionary */
  size_t point_count;    /* of the last fit's scan; 0 before */
  size_t landmark_count; /* of the last fit; 0 before */
  double size;           /* the root of the reference's area: what shares of lengths are of */
  double create_seconds;
} exm_registration_info;

EXM_API void exm_registration_info_init(exm_registration_info *info);
EXM_API exm_status exm_registration_get_info(const exm_registration *registration, exm_registration_info *info);

#ifdef __cplusplus
}
#endif

#endif
