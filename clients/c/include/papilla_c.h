/* Papilla inside a program: a map of pressure, or poses of objects, in; forces and a map of strain
 * energy density (SED) out. No socket, no thread of its own; a call runs on the caller's thread and
 * returns when it is done.
 *
 *   PapillaModel *model = papilla_model_new();
 *   PapillaSession *session = papilla_session_new();
 *   papilla_model_load(model, "models", NULL, NULL);
 *   papilla_session_open(session, model, "{\"type\": \"hello\"}");
 *   papilla_send_map(session, 0, pressure_pa, PAPILLA_MAP_LEN, time_us, &answer);
 *
 * Units: mm, N, Pa, J/m3, us. Maps are 224 x 224, row-major, row 0 at the tip of the finger. The
 * finger's frame, the hello and all numbers of an answer: docs/reference/protocol.md.
 *
 * Memory. papilla_session_open takes what frames need. On Unix a frame asks neither malloc nor the
 * system for memory, once the first ones were computed (docs/reference/clients/c.md).
 * What an answer points to is the session's, until the next call with that session.
 *
 * Threads. Sessions are independent: one thread each at a time. Calls with one handle must not
 * overlap; a model may be given to papilla_session_open from one thread at a time.
 *
 * Errors. A call that returns another status than PAPILLA_OK changed nothing but the last error
 * of its handle; an open session goes on. After PAPILLA_INTERNAL open or load anew. */
#ifndef PAPILLA_C_H
#define PAPILLA_C_H

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/* Raised when a struct or a function changes; compare with papilla_abi(). */
#define PAPILLA_ABI 2

#define PAPILLA_MAP_SIDE_PX 224
#define PAPILLA_MAP_LEN 50176 /* 224 x 224 */

typedef int32_t PapillaStatus;
enum {
  PAPILLA_OK = 0,
  PAPILLA_BAD_POINTER = 1,      /* null, out of line, or a text that is not UTF-8 */
  PAPILLA_NOT_OPEN = 2,         /* no model is loaded, or the session is not open */
  PAPILLA_NO_FILE = 3,          /* a file cannot be read */
  PAPILLA_BAD_MODEL = 4,        /* a file is damaged, or of another atlas */
  PAPILLA_BAD_JSON = 5,         /* the hello is not one, or asks for what only a service has */
  PAPILLA_UNKNOWN_VERSION = 6,  /* a hello of another version than 3 */
  PAPILLA_UNKNOWN_TIER = 7,     /* the folder has no such model, or another one was loaded */
  PAPILLA_UNKNOWN_EFFECT = 8,   /* no such effect, or the model does not render it */
  PAPILLA_BAD_EFFECT = 9,       /* a parameter of an effect is missing or unusable */
  PAPILLA_BAD_CONTACT = 10,     /* a shape, pose, gap, finger or net force that cannot be */
  PAPILLA_ATLAS_MISMATCH = 11,  /* the hello names another atlas */
  PAPILLA_WRONG_TYPE = 12,      /* samples that are not f32, or a frame of another kind than the hello's */
  PAPILLA_WRONG_LENGTH = 13,    /* another number of samples, poses or vertices than is due */
  PAPILLA_NOT_FINITE = 14,      /* a sample is NaN or infinite */
  PAPILLA_NEGATIVE_PRESSURE = 15, /* a sample is below zero */
  PAPILLA_OUT_OF_RANGE = 16,    /* a sample is above what is taken */
  PAPILLA_INTERNAL = 17         /* a fault of the library; papilla_*_error says more */
};

/* Bits of PapillaAnswer.flags. */
#define PAPILLA_FLAG_OUT_OF_RANGE 1u /* above what the model was trained on: an extrapolation */
#define PAPILLA_FLAG_NO_CONTACT 2u   /* nothing touches the finger: SED is zero, no network was asked */
#define PAPILLA_FLAG_UNFAMILIAR 4u   /* rougher or heavier than any map the model was trained on */
#define PAPILLA_FLAG_UNSETTLED 8u    /* the contact solve did not settle: its answer is rough */
#define PAPILLA_FLAG_CUT_OFF 16u     /* the contact reaches the edge of the atlas */
#define PAPILLA_FLAG_NOT_TRACKED 32u /* the frame told that nobody knows where things are; all is zero */
#define PAPILLA_FLAG_COARSE_CLOCK 64u /* time_us ticks so coarsely, or is in ms or ns, that rates and spikes may be far off */

/* A folder of models, read once, for any number of sessions. */
typedef struct PapillaModel PapillaModel;
/* One hand, and the memory of its frames. */
typedef struct PapillaSession PapillaSession;

/* data is NULL if the list is empty. */
typedef struct PapillaSamples {
  const float *data;
  size_t count;
} PapillaSamples;

typedef struct PapillaModelInfo {
  const char *name;
  const char *atlas_hash;
  float pressure_max_pa;   /* greatest pressure the model was trained on */
  float sed_max_j_per_m3;  /* greatest SED it was trained on */
  float mm_per_px;
  uint32_t has_contact;    /* 1: poses and gaps are taken */
  uint32_t vertex_count;
  uint32_t triangle_count;
  const uint32_t *triangles;      /* [triangle_count][3] */
  const float *skin_mm;           /* [vertex_count][3], undeformed, in the finger's frame */
  const float *skin_uv_px;        /* [vertex_count][2]: column, row */
  const float *interface_mm;
  const float *interface_uv_px;
} PapillaModelInfo;

/* Where an object is in the finger's frame: its origin, and its turn as a unit quaternion x y z w. */
typedef struct PapillaPose {
  float origin_mm[3];
  float quaternion[4];
} PapillaPose;

/* A net force to be met along a unit vector; of sessions whose hello says "force_target": true. */
typedef struct PapillaNetForce {
  float direction[3];
  float force_n;
} PapillaNetForce;

/* What pushes back on a finger, in its frame. */
typedef struct PapillaTouch {
  float force_n[3];
  float torque_n_mm[3];      /* about the frame's origin */
  float area_mm2;            /* in contact, on the deformed skin */
  float centre_mm[3];        /* of pressure; the origin without contact */
  float penetration_mm;      /* deepest vertex left inside a thing */
  float stiffness_n_per_mm;  /* 0 unless the hello says "stiffness": true */
  float travel_mm;           /* of the things, to meet the net force */
  float pressure_max_pa;
  float share;               /* of the second order in the displacement */
  float solve_us;            /* time of the contact solve */
} PapillaTouch;

/* A map in sixteen numbers: the effect "summary". */
typedef struct PapillaSummary {
  float force_n, contact_area_mm2, pressure_max_pa, pressure_u_px, pressure_v_px;
  float sed_max_j_per_m3, sed_max_u_px, sed_max_v_px, sed_integral_uj_per_m;
  float sed_u_px, sed_v_px, sed_uu_px2, sed_uv_px2, sed_vv_px2, sed_mean_j_per_m3, sa1_rate_hz;
} PapillaSummary;

/* How wrong an answer is likely to be, by what it shows: relative errors against finite elements.
 * What is not stated is infinite. */
typedef struct PapillaErrorEstimate {
  float sed_median;   /* half of such maps err less (relative L2) */
  float sed_p90;      /* nine of ten such maps err less */
  float force_median; /* the same of the size of the force that contact found */
  float force_p90;
} PapillaErrorEstimate;

/* What a frame came to; what the hello did not ask for is NULL or empty. */
typedef struct PapillaAnswer {
  uint32_t flags;
  uint32_t has_sed;  /* 0: no network was asked for */
  uint32_t column, row, width, height;  /* of map: all of it, unless "contact_window" cuts it */
  PapillaSamples map;          /* SED, J/m3 */
  PapillaSamples vertices;     /* in place of map: "answer_layout": "vertices" */
  PapillaSamples pressure_pa;  /* what was found: "pressure" */
  PapillaSamples rates_hz;     /* of SA1 afferents, whole map or vertices: the effect "afferents" */
  PapillaSamples points;       /* SED, J/m3 */
  PapillaSamples point_rates_hz;
  PapillaSamples actuators;
  const PapillaSummary *summary;
  const PapillaTouch *touch;   /* to poses and gaps */
  const PapillaErrorEstimate *error_estimate;
} PapillaAnswer;

uint32_t papilla_abi(void);
const char *papilla_version(void);
/* As "wrong_length": the words of the protocol's error codes. */
const char *papilla_status_name(PapillaStatus status);

/* NULL only without memory. */
PapillaModel *papilla_model_new(void);
void papilla_model_free(PapillaModel *model);
/* What the last failed call with the handle said, for people; empty after one that went well. */
const char *papilla_model_error(const PapillaModel *model);
/* Reads index.json, atlas.json, TIER.onnx and TIER.json of a folder (tier NULL: of the index's
 * defaults, one for maps of pressure and one for poses and gaps; a session uses the one for its
 * input), and a contact model of `fe-datagen contact` (NULL: none). Paths are UTF-8. Takes
 * seconds. Sessions keep the model that they were opened with. */
PapillaStatus papilla_model_load(PapillaModel *model, const char *folder, const char *tier, const char *contact);
/* Pointers of info stay valid until the next load, or the end of the handle. */
PapillaStatus papilla_model_info(PapillaModel *model, PapillaModelInfo *info);
/* Draws values at the vertices of the skin (vertex_count) as a map of PAPILLA_MAP_LEN. */
PapillaStatus papilla_model_rasterise(PapillaModel *model, const float *values, size_t count, float *map);

/* NULL only without memory. */
PapillaSession *papilla_session_new(void);
void papilla_session_free(PapillaSession *session);
const char *papilla_session_error(const PapillaSession *session);
/* The member that the error is about, as "objects[0].shape". */
const char *papilla_session_error_field(const PapillaSession *session);
/* Opens a session, or an open one anew. hello: the protocol's hello, as JSON; without
 * its members budget_us, stale_after_us and pressure_scale_pa. */
PapillaStatus papilla_session_open(PapillaSession *session, const PapillaModel *model, const char *hello);
/* How the open session finds pressure, as "pixels": the hello's method, or else the most accurate one
 * that can serve it. Empty where frames are pressure. Valid until the next open. */
const char *papilla_session_method(const PapillaSession *session);
/* What the open session cannot do as one might expect, a line each; empty if there is nothing. */
const char *papilla_session_warning(const PapillaSession *session);

/* A frame. finger: its number, from 0. time_us: the program's clock; effects that change with time
 * go by it. net: a force to be met, or NULL.
 *
 * "input": "pressure" (a hello's default): PAPILLA_MAP_LEN samples, Pa, or vertex_count with
 * "input_layout": "vertices". */
PapillaStatus papilla_send_map(PapillaSession *session, uint8_t finger, const float *pressure_pa, size_t count,
                               uint64_t time_us, PapillaAnswer *answer);
/* "input": "objects": a pose of each object of the hello. */
PapillaStatus papilla_send_poses(PapillaSession *session, uint8_t finger, const PapillaPose *poses, size_t count,
                                 const PapillaNetForce *net, uint64_t time_us, PapillaAnswer *answer);
/* "input": "gaps": how deep the undeformed skin lies in things, mm; negative in air. A map, or
 * vertex_count with "input_layout": "vertices"; with "velocity": true as many x y z mm/s behind. */
PapillaStatus papilla_send_gaps(PapillaSession *session, uint8_t finger, const float *depth_mm, size_t count,
                                const PapillaNetForce *net, uint64_t time_us, PapillaAnswer *answer);

/* Tracking is lost: nobody knows where things are, or what presses. The answer is zero, no unit fires, and
 * what the session remembers waits for the next frame. Better than a pose that is not true. */
PapillaStatus papilla_send_not_tracked(PapillaSession *session, uint8_t finger, uint64_t time_us, PapillaAnswer *answer);

#ifdef __cplusplus
}
#endif

#endif
