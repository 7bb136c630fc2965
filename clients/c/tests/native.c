/* What a C program may get wrong, and what a frame costs. Arguments: folder of models, contact model.
 * With COUNTS defined malloc is counted, and what asks the system for memory. */
#define _GNU_SOURCE
#include <dirent.h>
#include <errno.h>
#include <math.h>
#include <pthread.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <papilla_c.h>

_Static_assert(sizeof(void *) != 8 || sizeof(PapillaAnswer) == 160, "PapillaAnswer");
_Static_assert(sizeof(void *) != 8 || offsetof(PapillaAnswer, map) == 24, "PapillaAnswer.map");
_Static_assert(sizeof(void *) != 8 || sizeof(PapillaModelInfo) == 80, "PapillaModelInfo");
_Static_assert(sizeof(void *) != 8 || offsetof(PapillaModelInfo, triangles) == 40, "PapillaModelInfo.triangles");
_Static_assert(sizeof(PapillaPose) == 28 && sizeof(PapillaNetForce) == 16, "PapillaPose, PapillaNetForce");
_Static_assert(sizeof(PapillaTouch) == 64 && sizeof(PapillaSummary) == 64, "PapillaTouch, PapillaSummary");

static int failures = 0;
#define CHECK(what) \
  do { \
    if (!(what)) ++failures, printf("%s:%d: %s\n", __FILE__, __LINE__, #what); \
  } while (0)

/* What this thread has asked for, and how often any thread has asked the system for pages. */
static _Thread_local long allocations = 0;
static _Atomic long pages = 0;
#ifdef COUNTS
extern void *__libc_malloc(size_t), *__libc_calloc(size_t, size_t), *__libc_realloc(void *, size_t);
extern void *__libc_memalign(size_t, size_t);
void *malloc(size_t size) { return ++allocations, __libc_malloc(size); }
void *calloc(size_t count, size_t size) { return ++allocations, __libc_calloc(count, size); }
void *realloc(void *block, size_t size) { return ++allocations, __libc_realloc(block, size); }
void *aligned_alloc(size_t align, size_t size) { return ++allocations, __libc_memalign(align, size); }
int posix_memalign(void **block, size_t align, size_t size) {
  ++allocations;
  *block = __libc_memalign(align, size);
  return *block ? 0 : ENOMEM;
}
void *mmap(void *at, size_t size, int protection, int flags, int file, off_t from) {
  ++pages;
  return ++allocations, (void *)syscall(SYS_mmap, at, size, protection, flags, file, from);
}
void *mmap64(void *at, size_t size, int protection, int flags, int file, off64_t from) {
  return mmap(at, size, protection, flags, file, from);
}
int munmap(void *at, size_t size) { return ++allocations, (int)syscall(SYS_munmap, at, size); }
int madvise(void *at, size_t size, int advice) { return ++allocations, (int)syscall(SYS_madvise, at, size, advice); }
void *mremap(void *old, size_t old_size, size_t size, int flags, ...) {
  va_list more;
  va_start(more, flags);
  void *const to = flags & MREMAP_FIXED ? va_arg(more, void *) : NULL;
  va_end(more);
  ++pages;
  return ++allocations, (void *)syscall(SYS_mremap, old, old_size, size, flags, to);
}
#endif

static const char *folder, *contact;
static float bump[PAPILLA_MAP_LEN], nothing[PAPILLA_MAP_LEN];

#define HELLO(members) "{\"type\": \"hello\", \"version\": 3" members "}"
#define BALL ", \"input\": \"objects\", \"objects\": [{\"shape\": {\"shape\": \"sphere\", \"radius_mm\": 10}}]"

static PapillaPose ball(float depth_mm) {
  const PapillaPose pose = {{11.25f, 0.0f, -16.53f + depth_mm}, {0, 0, 0, 1}};
  return pose;
}

static void words(void) {
  CHECK(papilla_abi() == PAPILLA_ABI);
  CHECK(strchr(papilla_version(), '.') != NULL);
  CHECK(strcmp(papilla_status_name(PAPILLA_WRONG_LENGTH), "wrong_length") == 0);
  CHECK(strcmp(papilla_status_name(-7), "internal") == 0 && strcmp(papilla_status_name(999), "internal") == 0);
}

static void bad_models(void) {
  CHECK(papilla_model_load(NULL, folder, NULL, NULL) == PAPILLA_BAD_POINTER);
  CHECK(strcmp(papilla_model_error(NULL), "model is null") == 0);
  papilla_model_free(NULL);
  PapillaModel *model = papilla_model_new();
  PapillaModelInfo info;
  CHECK(model && papilla_model_error(model)[0] == 0);
  CHECK(papilla_model_info(model, &info) == PAPILLA_NOT_OPEN);
  CHECK(papilla_model_load(model, NULL, NULL, NULL) == PAPILLA_BAD_POINTER);
  CHECK(papilla_model_load(model, "\xff\xfe", NULL, NULL) == PAPILLA_BAD_POINTER);
  CHECK(papilla_model_load(model, "no/such/folder", NULL, NULL) == PAPILLA_NO_FILE);
  CHECK(strstr(papilla_model_error(model), "no/such/folder/index.json") != NULL);
  CHECK(papilla_model_load(model, folder, "../nano", NULL) == PAPILLA_UNKNOWN_TIER);
  CHECK(papilla_model_load(model, folder, "nano", "no.contact") == PAPILLA_NO_FILE);
  CHECK(papilla_model_load(model, folder, "nano", "/dev/null") == PAPILLA_BAD_MODEL);
  CHECK(papilla_model_info(model, &info) == PAPILLA_NOT_OPEN);
  CHECK(papilla_model_load(model, folder, "nano", NULL) == PAPILLA_OK && papilla_model_error(model)[0] == 0);
  CHECK(papilla_model_info(model, NULL) == PAPILLA_BAD_POINTER);
  CHECK(papilla_model_info(model, &info) == PAPILLA_OK && strcmp(info.name, "nano") == 0);
  CHECK(info.has_contact == 0 && info.vertex_count > 1000 && strlen(info.atlas_hash) == 64);
  for (uint32_t i = 0; i < 3 * info.triangle_count; ++i) CHECK(info.triangles[i] < info.vertex_count);
  static float map[PAPILLA_MAP_LEN];
  float *values = calloc(info.vertex_count, sizeof(float));
  CHECK(papilla_model_rasterise(model, values, info.vertex_count - 1, map) == PAPILLA_WRONG_LENGTH);
  CHECK(papilla_model_rasterise(model, NULL, info.vertex_count, map) == PAPILLA_BAD_POINTER);
  CHECK(papilla_model_rasterise(model, values, info.vertex_count, NULL) == PAPILLA_BAD_POINTER);
  CHECK(papilla_model_rasterise(model, (float *)((char *)values + 1), 2, map) == PAPILLA_BAD_POINTER);
  CHECK(papilla_model_rasterise(model, values, SIZE_MAX, map) == PAPILLA_WRONG_LENGTH);
  CHECK(papilla_model_rasterise(model, values, info.vertex_count, map) == PAPILLA_OK);
  free(values);
  /* Poses need a contact model. */
  PapillaSession *session = papilla_session_new();
  CHECK(papilla_session_open(session, model, HELLO(BALL)) == PAPILLA_BAD_CONTACT);
  CHECK(strcmp(papilla_session_error_field(session), "input") == 0);
  /* A session outlives the handle that it was opened with. */
  PapillaAnswer answer;
  CHECK(papilla_session_open(session, model, HELLO("")) == PAPILLA_OK);
  papilla_model_free(model);
  CHECK(papilla_send_map(session, 0, bump, PAPILLA_MAP_LEN, 0, &answer) == PAPILLA_OK && answer.map.data);
  papilla_session_free(session);
}

static void bad_calls(const PapillaModel *model) {
  PapillaAnswer answer;
  const PapillaPose pose = ball(0.3f);
  const PapillaNetForce net = {{0, 0, 1}, 0.1f};
  CHECK(papilla_session_open(NULL, model, HELLO("")) == PAPILLA_BAD_POINTER);
  CHECK(papilla_send_map(NULL, 0, bump, PAPILLA_MAP_LEN, 0, &answer) == PAPILLA_BAD_POINTER);
  CHECK(strcmp(papilla_session_error(NULL), "session is null") == 0);
  papilla_session_free(NULL);
  PapillaSession *session = papilla_session_new();
  PapillaModel *empty = papilla_model_new();
  CHECK(papilla_session_open(session, empty, HELLO("")) == PAPILLA_NOT_OPEN);
  papilla_model_free(empty);
  CHECK(papilla_send_map(session, 0, bump, PAPILLA_MAP_LEN, 0, &answer) == PAPILLA_NOT_OPEN);
  CHECK(papilla_session_open(session, NULL, HELLO("")) == PAPILLA_BAD_POINTER);
  CHECK(papilla_session_open(session, model, NULL) == PAPILLA_BAD_POINTER);
  CHECK(papilla_session_open(session, model, "{") == PAPILLA_BAD_JSON);
  CHECK(papilla_session_open(session, model, HELLO(", \"tire\": 1")) == PAPILLA_BAD_JSON);
  CHECK(papilla_session_open(session, model, HELLO(", \"budget_us\": 5")) == PAPILLA_BAD_JSON);
  CHECK(papilla_session_open(session, model, HELLO(", \"sample_type\": \"u8\"")) == PAPILLA_WRONG_TYPE);
  CHECK(papilla_session_open(session, model, "{\"type\": \"hello\", \"version\": 1}") == PAPILLA_UNKNOWN_VERSION);
  CHECK(papilla_session_open(session, model, HELLO("")) == PAPILLA_OK);
  /* What is refused leaves the session open. */
  CHECK(papilla_session_open(session, model, "{") == PAPILLA_BAD_JSON);
  CHECK(papilla_send_map(session, 0, bump, PAPILLA_MAP_LEN - 1, 0, &answer) == PAPILLA_WRONG_LENGTH);
  CHECK(papilla_send_map(session, 0, NULL, PAPILLA_MAP_LEN, 0, &answer) == PAPILLA_BAD_POINTER);
  CHECK(papilla_send_map(session, 0, NULL, 0, 0, &answer) == PAPILLA_WRONG_LENGTH);
  CHECK(papilla_send_map(session, 0, bump, PAPILLA_MAP_LEN, 0, NULL) == PAPILLA_BAD_POINTER);
  CHECK(papilla_send_map(session, 1, bump, PAPILLA_MAP_LEN, 0, &answer) == PAPILLA_BAD_CONTACT);
  CHECK(papilla_send_poses(session, 0, &pose, 1, NULL, 0, &answer) == PAPILLA_WRONG_TYPE);
  CHECK(papilla_send_map(session, 0, bump, PAPILLA_MAP_LEN, 0, &answer) == PAPILLA_OK);
  CHECK(papilla_session_error(session)[0] == 0);
  CHECK(papilla_session_open(session, model, HELLO(BALL)) == PAPILLA_OK);
  const PapillaPose many[40] = {{{0}, {0}}};
  CHECK(papilla_send_poses(session, 0, many, 40, NULL, 0, &answer) == PAPILLA_WRONG_LENGTH);
  CHECK(papilla_send_poses(session, 0, many, 1, NULL, 0, &answer) == PAPILLA_BAD_CONTACT);
  CHECK(papilla_send_poses(session, 0, &pose, 1, &net, 0, &answer) == PAPILLA_BAD_CONTACT);
  CHECK(strcmp(papilla_session_error_field(session), "force_target") == 0);
  CHECK(papilla_send_gaps(session, 0, bump, PAPILLA_MAP_LEN, NULL, 0, &answer) == PAPILLA_WRONG_TYPE);
  CHECK(papilla_send_poses(session, 0, &pose, 1, NULL, 0, &answer) == PAPILLA_OK);
  CHECK(answer.touch && answer.touch->force_n[2] > 0 && answer.map.count == PAPILLA_MAP_LEN && !answer.summary);
  papilla_session_free(session);
}

/* Allocations of a warm frame; each of 20 frames costs the same. */
static long frame_costs(const PapillaModel *model, const char *hello, const float *map) {
  PapillaSession *session = papilla_session_new();
  PapillaAnswer answer = {0};
  long cost = -1;
  if (papilla_session_open(session, model, hello) != PAPILLA_OK) {
    ++failures, printf("%s: %s\n", hello, papilla_session_error(session));
    papilla_session_free(session);
    return -1;
  }
  for (int frame = 0; frame < 120; ++frame) {
    const PapillaPose pose = ball(0.2f + 0.001f * (float)(frame % 20));
    const long before = allocations;
    const PapillaStatus status = map ? papilla_send_map(session, 0, map, PAPILLA_MAP_LEN, 11111u * (unsigned)frame, &answer)
                                     : papilla_send_poses(session, 0, &pose, 1, NULL, 11111u * (unsigned)frame, &answer);
    const long spent = allocations - before;
    CHECK(status == PAPILLA_OK);
    if (frame == 100) cost = spent;
    CHECK(frame <= 100 || spent == cost);
  }
  papilla_session_free(session);
  return cost;
}

static int threads(void) {
  int count = 0;
  DIR *const tasks = opendir("/proc/self/task");
  for (const struct dirent *task; tasks && (task = readdir(tasks));) count += task->d_name[0] != '.';
  if (tasks) closedir(tasks);
  return count;
}

static void costs(const PapillaModel *model) {
  const char *const effects = HELLO(
      ", \"effects\": [\"summary\", \"afferents\", \"relaxation\", \"points\", \"contact_window\"],"
      " \"points\": [{\"px\": [110, 65]}]");
  CHECK(frame_costs(model, HELLO(""), bump) == 0);
  CHECK(frame_costs(model, HELLO(""), nothing) == 0);
  CHECK(frame_costs(model, HELLO(BALL ", \"map\": false, \"stiffness\": true"), NULL) == 0);
  CHECK(frame_costs(model, effects, bump) == 0);
  CHECK(frame_costs(model, HELLO(BALL ", \"effects\": [\"summary\"]"), NULL) == 0);
  CHECK(threads() == 1);
}

/* What is freed serves what comes next: the library's heap stops growing. No sanitizer looks into it.
 * Models are read on a thread of their own, so pages are counted for all threads. */
static void nothing_leaks(const PapillaModel *model) {
  long warm = 0;
  for (int cycle = 0; cycle < 150; ++cycle) {
    if (cycle == 50) warm = pages;
    PapillaModel *const other = cycle % 25 == 0 ? papilla_model_new() : NULL;
    CHECK(other == NULL || papilla_model_load(other, folder, "nano", contact) == PAPILLA_OK);
    PapillaSession *const session = papilla_session_new();
    PapillaAnswer answer = {0};
    CHECK(papilla_session_open(session, model, HELLO("")) == PAPILLA_OK);
    CHECK(papilla_session_open(session, model, HELLO(", \"colour\": 1")) != PAPILLA_OK);
    CHECK(papilla_send_map(session, 0, bump, PAPILLA_MAP_LEN, 0, &answer) == PAPILLA_OK);
    papilla_session_free(session);
    papilla_model_free(other);
  }
  CHECK(pages == warm);
}

static void *at_once(void *model) {
  PapillaSession *session = papilla_session_new();
  PapillaAnswer answer = {0};
  double sum = 0;
  CHECK(papilla_session_open(session, model, HELLO(BALL)) == PAPILLA_OK);
  for (int frame = 0; frame < 20; ++frame) {
    const PapillaPose pose = ball(0.02f * (float)frame);
    CHECK(papilla_send_poses(session, 0, &pose, 1, NULL, 0, &answer) == PAPILLA_OK);
    for (size_t i = 0; i < answer.map.count; ++i) sum += answer.map.data[i];
  }
  papilla_session_free(session);
  double *const found = malloc(sizeof sum);
  *found = sum;
  return found;
}

/* Two sessions on one model, each on a thread: the same bits. */
static void two_threads(PapillaModel *model) {
  pthread_t both[2];
  double *sums[2];
  for (int i = 0; i < 2; ++i) CHECK(pthread_create(&both[i], NULL, at_once, model) == 0);
  for (int i = 0; i < 2; ++i) CHECK(pthread_join(both[i], (void **)&sums[i]) == 0);
  CHECK(memcmp(sums[0], sums[1], sizeof *sums[0]) == 0 && *sums[0] > 0);
  free(sums[0]), free(sums[1]);
}

int main(int count, char **arguments) {
  if (count != 3) return puts("native MODELS CONTACT_MODEL"), 2;
  folder = arguments[1], contact = arguments[2];
  for (int i = 0; i < PAPILLA_MAP_LEN; ++i) {
    const float x = (float)(i % 224) - 118, y = (float)(i / 224) - 105;
    bump[i] = 20000 * expf(-(x * x + y * y) / 242);
  }
  words();
  bad_models();
  PapillaModel *model = papilla_model_new();
  CHECK(papilla_model_load(model, folder, "nano", contact) == PAPILLA_OK);
#ifdef COUNTS
  CHECK(allocations > 0 && pages > 0); /* what would see nothing could not fail */
#endif
  costs(model);
  nothing_leaks(model);
  bad_calls(model);
  two_threads(model);
  papilla_model_free(model);
  puts(failures ? "FAILED" : "native: all checks passed");
  return failures != 0;
}
