/* Times Embree 3 on rays that `ray_rate --dump DIR` wrote, one ray at a time and in packets of 8 and 16.
 *
 *   gcc -O2 -march=native tools/peers/embree.c -lembree3 -lpthread -lm -o embree && ./embree DIR NAME...
 *
 * Prints one line for each mesh, set of rays and call: million rays per second of processor time (median of the runs),
 * the part that hit, and their mean distance; and the time of a build of medium quality. Packets of primary rays carry
 * the coherent flag; single rays carry whichever flag is faster.
 */
#define _GNU_SOURCE
#include <embree3/rtcore.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <time.h>

static double cpu_seconds(void)
{
    struct timespec now;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
    return now.tv_sec + now.tv_nsec * 1e-9;
}

static double wall_seconds(void)
{
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return now.tv_sec + now.tv_nsec * 1e-9;
}

static void *read_file(const char *folder, const char *name, const char *kind, size_t *bytes)
{
    char path[4096];
    snprintf(path, sizeof path, "%s/%s.%s", folder, name, kind);
    FILE *file = fopen(path, "rb");
    if (!file) {
        perror(path);
        exit(1);
    }
    fseek(file, 0, SEEK_END);
    *bytes = (size_t)ftell(file);
    rewind(file);
    void *data = malloc(*bytes + 16);
    if (fread(data, 1, *bytes, file) != *bytes) {
        perror(path);
        exit(1);
    }
    fclose(file);
    return data;
}

struct totals {
    size_t hits;
    double distance;
};

static struct totals trace(RTCScene scene, const float *rays, size_t count, int width, int any, int coherent)
{
    struct totals totals = { 0, 0 };
    struct RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    context.flags = coherent ? RTC_INTERSECT_CONTEXT_FLAG_COHERENT : RTC_INTERSECT_CONTEXT_FLAG_INCOHERENT;
#define FILL(R, I, SRC) \
    (R).org_x[I] = (SRC)[0], (R).org_y[I] = (SRC)[1], (R).org_z[I] = (SRC)[2], (R).dir_x[I] = (SRC)[3], \
    (R).dir_y[I] = (SRC)[4], (R).dir_z[I] = (SRC)[5], (R).tnear[I] = 0, (R).tfar[I] = INFINITY, (R).time[I] = 0, \
    (R).mask[I] = -1, (R).id[I] = 0, (R).flags[I] = 0
#define PACKET(N) \
    for (size_t base = 0; base < count; base += N) { \
        int valid[N] __attribute__((aligned(64))); \
        struct RTCRayHit##N query; \
        for (int i = 0; i < N; i++) { \
            size_t number = base + i < count ? base + i : base; \
            valid[i] = base + i < count ? -1 : 0; \
            FILL(query.ray, i, rays + 6 * number); \
            query.hit.geomID[i] = RTC_INVALID_GEOMETRY_ID; \
            query.hit.instID[0][i] = RTC_INVALID_GEOMETRY_ID; \
        } \
        if (any) \
            rtcOccluded##N(valid, scene, &context, &query.ray); \
        else \
            rtcIntersect##N(valid, scene, &context, &query); \
        for (int i = 0; i < N && base + i < count; i++) { \
            if (any ? query.ray.tfar[i] < 0 : query.hit.geomID[i] != RTC_INVALID_GEOMETRY_ID) { \
                totals.hits++; \
                totals.distance += any ? 0 : query.ray.tfar[i]; \
            } \
        } \
    }
    if (width == 16) {
        PACKET(16)
    } else if (width == 8) {
        PACKET(8)
    } else {
        for (size_t number = 0; number < count; number++) {
            const float *source = rays + 6 * number;
            struct RTCRayHit query;
            query.ray.org_x = source[0], query.ray.org_y = source[1], query.ray.org_z = source[2];
            query.ray.dir_x = source[3], query.ray.dir_y = source[4], query.ray.dir_z = source[5];
            query.ray.tnear = 0, query.ray.tfar = INFINITY, query.ray.time = 0;
            query.ray.mask = -1, query.ray.id = 0, query.ray.flags = 0;
            query.hit.geomID = RTC_INVALID_GEOMETRY_ID, query.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
            if (any)
                rtcOccluded1(scene, &context, &query.ray);
            else
                rtcIntersect1(scene, &context, &query);
            if (any ? query.ray.tfar < 0 : query.hit.geomID != RTC_INVALID_GEOMETRY_ID) {
                totals.hits++;
                totals.distance += any ? 0 : query.ray.tfar;
            }
        }
    }
    return totals;
}

static int ascending(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

int main(int argc, char **argv)
{
    if (argc < 3) {
        fprintf(stderr, "usage: embree DIR NAME...\n");
        return 2;
    }
    RTCDevice device = rtcNewDevice("threads=2");
    for (int mesh = 2; mesh < argc; mesh++) {
        const char *name = argv[mesh];
        size_t position_bytes, triangle_bytes;
        float *positions = read_file(argv[1], name, "positions", &position_bytes);
        unsigned *triangles = read_file(argv[1], name, "triangles", &triangle_bytes);
        double walls[5], cpus[5];
        RTCScene scene = NULL;
        for (int run = 0; run < 5; run++) {
            if (scene)
                rtcReleaseScene(scene);
            scene = rtcNewScene(device);
            RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
            rtcSetSharedGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, positions, 0, 12, position_bytes / 12);
            rtcSetSharedGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, triangles, 0, 12, triangle_bytes / 12);
            rtcCommitGeometry(geometry);
            rtcAttachGeometry(scene, geometry);
            rtcReleaseGeometry(geometry);
            double cpu = cpu_seconds(), wall = wall_seconds();
            rtcCommitScene(scene);
            walls[run] = wall_seconds() - wall;
            cpus[run] = cpu_seconds() - cpu;
        }
        qsort(walls, 5, sizeof *walls, ascending);
        qsort(cpus, 5, sizeof *cpus, ascending);
        printf("%s build %.1f ms wall %.1f ms cpu\n", name, walls[2] * 1e3, cpus[2] * 1e3);
        const char *sets[] = { "primary", "random", "bounce" };
        for (int set = 0; set < 3; set++) {
            size_t ray_bytes;
            float *rays = read_file(argv[1], name, sets[set], &ray_bytes);
            size_t count = ray_bytes / 24;
            for (int any = 0; any < 2; any++) {
                for (int width = 1; width <= 16; width = width == 1 ? 8 : 2 * width) {
                    double rates[3] = { 0 };
                    struct totals totals = { 0, 0 };
                    for (int coherent = 0; coherent < 2; coherent++) {
                        double tries[3];
                        for (int run = 0; run < 3; run++) {
                            double begun = cpu_seconds(), spent = 0;
                            int repeats = 0;
                            while (spent < 0.25) {
                                totals = trace(scene, rays, count, width, any, coherent);
                                repeats++;
                                spent = cpu_seconds() - begun;
                            }
                            tries[run] = count * (double)repeats / spent * 1e-6;
                        }
                        qsort(tries, 3, sizeof *tries, ascending);
                        if (tries[1] > rates[0])
                            rates[0] = tries[1];
                    }
                    printf("%s %s %s %d %.2f Mrays/s hits %.3f mean t %.4f\n", name, sets[set], any ? "any" : "closest", width,
                           rates[0], totals.hits / (double)count, totals.hits ? totals.distance / totals.hits : 0.0);
                    fflush(stdout);
                }
            }
            free(rays);
        }
        rtcReleaseScene(scene);
        free(positions);
        free(triangles);
    }
    rtcReleaseDevice(device);
    return 0;
}
