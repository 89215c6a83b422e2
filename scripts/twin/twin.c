/*
 * The loop of the paper's Figure 3 in C with OpenMP: every particle looks for its neighbours, once along the linked list
 * of each bucket (Figure 1) and once along the relocated array (Figure 2), and sums the weight re / r - 1 of those within
 * the radius. Names such as bfst and RelocatePosition are the paper's.
 *
 * It is the twin of the same loop in Rust: from the same particles both must give the same sums to the last bit, since
 * each adds them in the same order - buckets with x outermost, ascending particles within a bucket - and neither fuses
 * or reorders an operation. README.md beside this file says how to build and run it.
 */
#include <float.h>
#include <limits.h>
#include <math.h>
#include <omp.h>
#include <stdarg.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#ifndef _OPENMP
#error "the twin needs OpenMP: build it with -fopenmp"
#endif
#if FLT_EVAL_METHOD != 0 || defined(__FAST_MATH__)
#error "the twin needs plain double precision: its sums must not depend on the compiler"
#endif

/* Few candidates are neighbours. The Rust program tells its compiler so, and so does this one. */
#if defined(__GNUC__)
#define RARELY(condition) __builtin_expect((condition), 0)
#define INLINED inline __attribute__((always_inline))
#else
#define RARELY(condition) (condition)
#define INLINED inline
#endif

enum { NONE = -1, NEIGHBORHOOD = 27, MOST_THREADS = 1024, MOST_PASSES = 100000, MOST_BUCKETS = 1 << 30 };
enum { COMPUTED_WRONGLY = 1, UNUSABLE_INPUT = 2 };

/* What the command line says. Lengths are metres. */
typedef struct {
    const char *particles;
    double low[3], high[3]; /* the domain that is tiled with buckets */
    double bucket_side, radius;
    bool root_first; /* compares distances, as Figure 3 does, and not their squares */
    int threads, passes;
    uint64_t seed; /* of the order of the two layouts in each pass */
} Request;

/* The particles and both of the ways to find their neighbours. */
typedef struct {
    int particles;
    double *Position; /* x0 y0 z0 x1 y1 z1 ... */
    int *bucket;      /* the bucket of each particle; NONE for one that is in no sum */
    int buckets;
    int neighborhood[NEIGHBORHOOD]; /* from a bucket's number to those around it, itself among them */
    int *bfst;                      /* the first particle of each bucket, or NONE */
    int *next;                      /* the particle after this one in its bucket, or NONE */
    int RELOCATE_ARRAY_WIDTH;       /* the fullest bucket */
    double *RelocatePosition;       /* RELOCATE_ARRAY_WIDTH positions a bucket, padded with zeros */
    int *relocate_index;            /* which particle each relocated position belongs to */
    int *RelocateReadableRange;     /* the number of particles in each bucket */
    double radius;
} Search;

static _Noreturn void fail(int code, const char *format, ...)
{
    va_list values;
    va_start(values, format);
    fputs("twin: ", stderr);
    vfprintf(stderr, format, values);
    fputc('\n', stderr);
    va_end(values);
    exit(code);
}

/* Zeros that nobody has touched yet, so that on machines with several memories they lie near who touches them first. */
static void *zeros(size_t count, size_t size)
{
    void *memory = calloc(count > 0 ? count : 1, size);
    if (memory == NULL)
        fail(COMPUTED_WRONGLY, "not enough memory for %zu entries", count);
    return memory;
}

/* What stands behind `key=` on the command line. */
static const char *value_of(const char *key, int count, char **arguments)
{
    size_t length = strlen(key);
    for (int k = 1; k < count; k++)
        if (strncmp(arguments[k], key, length) == 0 && arguments[k][length] == '=')
            return arguments[k] + length + 1;
    fail(UNUSABLE_INPUT, "`%s=` is missing; README.md says what to give", key);
}

/* Finite numbers with commas between them. */
static void numbers(const char *key, const char *text, int wanted, double *values)
{
    const char *rest = text;
    for (int d = 0; d < wanted; d++) {
        char *end;
        values[d] = strtod(rest, &end);
        if (end == rest || *end != (d + 1 < wanted ? ',' : '\0') || !isfinite(values[d]))
            fail(UNUSABLE_INPUT, "`%s` is `%s`; allowed: %d finite number(s), with commas", key, text, wanted);
        rest = end + 1;
    }
}

static int whole(const char *key, const char *text, int most)
{
    char *end;
    long value = strtol(text, &end, 10);
    if (end == text || *end != '\0' || value < 1 || value > most)
        fail(UNUSABLE_INPUT, "`%s` is `%s`; allowed are 1 to %d", key, text, most);
    return (int)value;
}

static Request parse(int count, char **arguments)
{
#define VALUE(key) key, value_of(key, count, arguments)
    Request request = {.particles = value_of("particles", count, arguments)};
    numbers(VALUE("low"), 3, request.low);
    numbers(VALUE("high"), 3, request.high);
    numbers(VALUE("bucket_side"), 1, &request.bucket_side);
    numbers(VALUE("radius"), 1, &request.radius);
    const char *test = value_of("distance_test", count, arguments);
    request.root_first = strcmp(test, "sqrt") == 0;
    request.threads = whole(VALUE("threads"), MOST_THREADS);
    request.passes = whole(VALUE("passes"), MOST_PASSES);
    request.seed = (uint64_t)whole(VALUE("seed"), INT_MAX);
#undef VALUE
    if (count != 1 + 9)
        fail(UNUSABLE_INPUT, "%d settings are given; allowed are the 9 that README.md names, each once", count - 1);
    if (!request.root_first && strcmp(test, "squared") != 0)
        fail(UNUSABLE_INPUT, "`distance_test` is `%s`; allowed are sqrt or squared", test);
    if (request.radius <= 0.0 || request.bucket_side < request.radius)
        fail(UNUSABLE_INPUT, "`radius` is %g; allowed are numbers above 0 up to `bucket_side`", request.radius);
    return request;
}

/* Reads the particles that `repro simulate` or an experiment left: `id,kind,x_m,y_m,z_m,...`, a line a particle. Each
 * thread touches its own share of them first. */
static bool *read_particles(const Request *request, Search *search)
{
    FILE *file = fopen(request->particles, "r");
    char line[1024], kind[16];
    int lines = 0, id;
    while (file != NULL && lines < INT_MAX / 3 && fgets(line, sizeof line, file) != NULL)
        lines++;
    if (lines < 2 || fseek(file, 0, SEEK_SET) != 0 || fgets(line, sizeof line, file) == NULL ||
        strncmp(line, "id,kind,x_m,y_m,z_m,", 20) != 0)
        fail(UNUSABLE_INPUT, "%s: cannot be read, or holds no particles", request->particles);
    const int count = search->particles = lines - 1;
    bool *is_ghost = zeros((size_t)count, sizeof *is_ghost);
    double *read = zeros(3 * (size_t)count, sizeof *read);
    for (int i = 0; i < count; i++) {
        double *x = &read[3 * (size_t)i];
        bool there = fgets(line, sizeof line, file) != NULL;
        if (!there || sscanf(line, "%d,%15[^,],%lf,%lf,%lf,", &id, kind, &x[0], &x[1], &x[2]) != 5 || id != i || !isfinite(x[0]) || !isfinite(x[1]) || !isfinite(x[2]))
            fail(UNUSABLE_INPUT, "%s, line %d: no particle of number %d", request->particles, i + 2, i);
        is_ghost[i] = strcmp(kind, "ghost") == 0;
    }
    fclose(file);
    search->Position = zeros(3 * (size_t)count, sizeof *search->Position);
#pragma omp parallel for schedule(static)
    for (int i = 0; i < count; i++)
        memcpy(&search->Position[3 * (size_t)i], &read[3 * (size_t)i], 3 * sizeof *read);
    free(read);
    return is_ghost;
}

/* Tiles the domain, with a layer of empty buckets around it, and puts each particle into its bucket. */
static void assign_buckets(const Request *request, Search *search, const bool *is_ghost)
{
    long cells[3];
    double product = 1.0;
    for (int d = 0; d < 3; d++) {
        double count = floor((request->high[d] - request->low[d]) / request->bucket_side) + 3.0;
        product *= count >= 3.0 ? count : NAN;
        if (!(product <= MOST_BUCKETS))
            fail(UNUSABLE_INPUT, "`low`, `high` and `bucket_side` allow no grid of up to %d buckets", MOST_BUCKETS);
        cells[d] = (long)count;
    }
    search->buckets = (int)(cells[0] * cells[1] * cells[2]);
    for (int n = 0; n < NEIGHBORHOOD; n++)
        search->neighborhood[n] = (int)(((n / 9 - 1) * cells[1] + n / 3 % 3 - 1) * cells[2] + n % 3 - 1);
    search->bucket = zeros((size_t)search->particles, sizeof *search->bucket);
    for (int i = 0; i < search->particles; i++) {
        const double *x = &search->Position[3 * (size_t)i];
        long bucket = 0;
        bool inside = !is_ghost[i];
        for (int d = 0; d < 3; d++) {
            inside = inside && request->low[d] <= x[d] && x[d] <= request->high[d];
            long cell = inside ? (long)((x[d] - request->low[d]) / request->bucket_side) + 1 : 0;
            bucket = bucket * cells[d] + (cell < cells[d] - 2 ? cell : cells[d] - 2);
        }
        search->bucket[i] = inside ? (int)bucket : NONE;
    }
}

/* Builds the lists from the last particle to the first, so that each ascends, and makes room for the fullest bucket. */
static void build_lists(Search *search)
{
    size_t buckets = (size_t)search->buckets;
    int *counts = zeros(buckets, sizeof *counts);
    search->bfst = zeros(buckets, sizeof *search->bfst);
    search->next = zeros((size_t)search->particles, sizeof *search->next);
    for (size_t b = 0; b < buckets; b++)
        search->bfst[b] = NONE;
    for (int i = search->particles - 1; i >= 0; i--) {
        int b = search->bucket[i];
        if (b == NONE)
            continue;
        search->next[i] = search->bfst[b];
        search->bfst[b] = i;
        if (++counts[b] > search->RELOCATE_ARRAY_WIDTH)
            search->RELOCATE_ARRAY_WIDTH = counts[b];
    }
    free(counts);
    size_t places = buckets * (size_t)search->RELOCATE_ARRAY_WIDTH;
    search->RelocatePosition = zeros(3 * places, sizeof *search->RelocatePosition);
    search->relocate_index = zeros(places, sizeof *search->relocate_index);
    search->RelocateReadableRange = zeros(buckets, sizeof *search->RelocateReadableRange);
}

/* Copies positions bucket after bucket: what relocation costs. */
static void relocate(Search *search)
{
#pragma omp parallel for schedule(dynamic, 64)
    for (int b = 0; b < search->buckets; b++) {
        size_t k = (size_t)b * (size_t)search->RELOCATE_ARRAY_WIDTH;
        int count = 0;
        for (int j = search->bfst[b]; j != NONE; j = search->next[j], k++, count++) {
            memcpy(&search->RelocatePosition[3 * k], &search->Position[3 * (size_t)j], 3 * sizeof(double));
            search->relocate_index[k] = j;
        }
        search->RelocateReadableRange[b] = count;
    }
}

/* Lines 7 to 11 of Figure 3: whether `there` is within the radius of `here`, and if so at which distance. */
static INLINED bool within(const double *here, const double *there, double radius, bool root_first, double *distance)
{
    double x = there[0] - here[0];
    double y = there[1] - here[1];
    double z = there[2] - here[2];
    double square = x * x + y * y + z * z;
    if (root_first) {
        *distance = sqrt(square);
        return *distance < radius;
    }
    if (RARELY(square < radius * radius)) {
        *distance = sqrt(square);
        return true;
    }
    return false;
}

static INLINED double sum_along_lists(const Search *search, int i, bool root_first)
{
    const double *Position = search->Position, *here = &Position[3 * (size_t)i], radius = search->radius;
    const int *next = search->next;
    double sum = 0.0, distance;
    if (search->bucket[i] == NONE)
        return sum;
    for (int n = 0; n < NEIGHBORHOOD; n++) {
        int bn = search->bucket[i] + search->neighborhood[n];
        for (int j = search->bfst[bn]; j != NONE; j = next[j])
            if (RARELY(within(here, &Position[3 * (size_t)j], radius, root_first, &distance)) && j != i)
                sum += radius / distance - 1.0;
    }
    return sum;
}

static INLINED double sum_along_rows(const Search *search, int i, bool root_first)
{
    const double *here = &search->Position[3 * (size_t)i], radius = search->radius;
    double sum = 0.0, distance;
    if (search->bucket[i] == NONE)
        return sum;
    for (int n = 0; n < NEIGHBORHOOD; n++) {
        int bn = search->bucket[i] + search->neighborhood[n];
        size_t row = (size_t)bn * (size_t)search->RELOCATE_ARRAY_WIDTH;
        const double *RelocatePosition = &search->RelocatePosition[3 * row];
        const int *index = &search->relocate_index[row];
        for (int k = 0; k < search->RelocateReadableRange[bn]; k++)
            if (RARELY(within(here, &RelocatePosition[3 * k], radius, root_first, &distance)) && index[k] != i)
                sum += radius / distance - 1.0;
    }
    return sum;
}

/* The four timed loops: two layouts, two distance tests. Returns seconds. */
static double timed(const Search *search, bool relocated, bool root_first, double *sums)
{
    const int count = search->particles;
    double began = omp_get_wtime();
    if (relocated && root_first) {
#pragma omp parallel for schedule(dynamic, 64)
        for (int i = 0; i < count; i++)
            sums[i] = sum_along_rows(search, i, true);
    } else if (relocated) {
#pragma omp parallel for schedule(dynamic, 64)
        for (int i = 0; i < count; i++)
            sums[i] = sum_along_rows(search, i, false);
    } else if (root_first) {
#pragma omp parallel for schedule(dynamic, 64)
        for (int i = 0; i < count; i++)
            sums[i] = sum_along_lists(search, i, true);
    } else {
#pragma omp parallel for schedule(dynamic, 64)
        for (int i = 0; i < count; i++)
            sums[i] = sum_along_lists(search, i, false);
    }
    return omp_get_wtime() - began;
}

/* The next number of the splitmix64 generator. */
static uint64_t random_number(uint64_t *state)
{
    uint64_t z = *state += 0x9e3779b97f4a7c15u;
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
    return z ^ (z >> 31);
}

/* FNV-1a, 64 bits, over the bits of all sums, lowest byte first. */
static uint64_t digest(const double *sums, int count)
{
    uint64_t hash = 0xcbf29ce484222325u, bits;
    for (int i = 0; i < count; i++) {
        memcpy(&bits, &sums[i], sizeof bits);
        for (int byte = 0; byte < 8; byte++)
            hash = (hash ^ (bits >> (8 * byte) & 0xff)) * 0x100000001b3u;
    }
    return hash;
}

static void require_same_sums(const double *list, const double *relocated, int count)
{
    for (int i = 0; i < count; i++) {
        if (!isfinite(list[i]))
            fail(COMPUTED_WRONGLY, "particle %d: its sum is not finite: another one lies at the same place", i);
        if (memcmp(&list[i], &relocated[i], sizeof *list) != 0)
            fail(COMPUTED_WRONGLY, "particle %d: %.17g with the list, %.17g relocated", i, list[i], relocated[i]);
    }
}

/* One pass: both layouts in random order, the copy just before the loop that reads it. Prints its times after the text
 * `before`; one that only warms up has none and prints nothing. */
static void run_pass(const Request *request, Search *search, double *sums[2], uint64_t *random, const char *before)
{
    bool list_first = random_number(random) & 1;
    double list_s = 0.0, relocation_s = 0.0, relocated_s = 0.0;
    for (int turn = 0; turn < 2; turn++) {
        if ((turn == 0) == list_first) {
            list_s = timed(search, false, request->root_first, sums[0]);
        } else {
            double began = omp_get_wtime();
            relocate(search);
            relocation_s = omp_get_wtime() - began;
            relocated_s = timed(search, true, request->root_first, sums[1]);
        }
    }
    require_same_sums(sums[0], sums[1], search->particles);
    if (before != NULL)
        printf("%s{\"list_first\":%s,\"list_s\":%.9f,\"relocation_s\":%.9f,\"relocated_s\":%.9f}", before,
               list_first ? "true" : "false", list_s, relocation_s, relocated_s);
}

int main(int count, char **arguments)
{
    Request request = parse(count, arguments);
    omp_set_dynamic(0);
    omp_set_num_threads(request.threads);
    Search search = {.radius = request.radius};
    bool *is_ghost = read_particles(&request, &search);
    assign_buckets(&request, &search, is_ghost);
    free(is_ghost);
    build_lists(&search);
    int threads = 0;
#pragma omp parallel
#pragma omp single
    threads = omp_get_num_threads();
    double *sums[2];
    for (int layout = 0; layout < 2; layout++)
        sums[layout] = zeros((size_t)search.particles, sizeof *sums[layout]);
    uint64_t random = request.seed;
    run_pass(&request, &search, sums, &random, NULL);
    printf("{\"particles\":%d,\"threads\":%d,\"passes\":[", search.particles, threads);
    for (int pass = 0; pass < request.passes; pass++)
        run_pass(&request, &search, sums, &random, pass == 0 ? "" : ",");
    printf("],\"digest\":\"%016llx\"}\n", (unsigned long long)digest(sums[0], search.particles));
    if (fflush(stdout) != 0)
        fail(COMPUTED_WRONGLY, "cannot write the answer");
    return 0;
}
