/* A flight over the planet `small`, with a second thread that asks for heights meanwhile.
 *
 * In:    how many frames, 300 unless told.
 * Out:   the last frame's counts and its digest, the same on every machine; heights answered.
 * Keeps: nothing.
 * Not here: drawing, pages of the host's own (docs/c.md).
 */

#include "overfly.h"

#include <math.h>
#include <pthread.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { PLACES = 500 };

/* What the two threads share. */
typedef struct Shared {
    _Atomic uint64_t ground; /* bits of the newest snapshot; 0 before the first */
    atomic_int stops;
    atomic_ulong answered;
} Shared;

static void must(ovf_status status, const char *what) {
    if (status != OVF_OK) {
        fprintf(stderr, "%s: status %d: %s\n", what, (int)status, ovf_last_error());
        exit(1);
    }
}

/* Heights of a strip of places, until the flight is over. */
static void *ask(void *pointer) {
    Shared *shared = pointer;
    double lat_deg[PLACES], lon_deg[PLACES], height_m[PLACES];
    uint8_t answer[PLACES];
    for (int i = 0; i < PLACES; i++) {
        lat_deg[i] = 10.0 + 0.02 * i;
        lon_deg[i] = 20.0 - 0.03 * i;
    }
    ovf_places places = {.struct_size = sizeof places, .lat_deg = lat_deg, .lon_deg = lon_deg};
    ovf_height_columns columns = {
        .struct_size = sizeof columns, .answer = answer, .height_m = height_m};
    ovf_query query = {
        .struct_size = sizeof query, .kind = OVF_QUERY_WITHIN, .bound_max_m = 5.0};
    while (!atomic_load(&shared->stops)) {
        ovf_ground ground = {atomic_load(&shared->ground)};
        ovf_status status = ovf_ground_heights(ground, &places, PLACES, &query, &columns);
        if (status == OVF_STALE) {
            continue; /* none yet, or a newer one has just taken its place */
        }
        must(status, "heights");
        for (int i = 0; i < PLACES; i++) {
            int found = answer[i] == OVF_ANSWER_OK || answer[i] == OVF_ANSWER_COARSER;
            if (found != !isnan(height_m[i])) {
                fprintf(stderr, "answer %d comes with %f m\n", answer[i], height_m[i]);
                exit(1);
            }
            atomic_fetch_add(&shared->answered, (unsigned long)found);
        }
    }
    return NULL;
}

/* Products and sums are rounded one by one: compile with -ffp-contract=off to get the digest. */
static ovf_view look(int frame) {
    ovf_view view = {.struct_size = sizeof view};
    view.eye = OVF_EYE_GEODETIC;
    view.attitude = OVF_ATTITUDE_ANGLES;
    view.width_px = 640;
    view.height_px = 360;
    view.eye_lat_rad = 0.25;
    view.eye_lon_rad = 0.3 + 0.001 * frame;
    view.eye_height_m = 600.0 - frame;
    view.yaw_rad = 1.5;
    view.pitch_rad = -0.4;
    view.field_of_view_rad = 1.0;
    view.near_m = 0.5;
    return view;
}

static void fly(ovf_terrain terrain, int frames, Shared *shared, ovf_frame *last) {
    for (int frame = 0; frame < frames; frame++) {
        ovf_view view = look(frame);
        ovf_frame_input input = {.struct_size = sizeof input,
                                 .view_count = 1,
                                 .views = &view,
                                 .time_s = frame / 60.0};
        must(ovf_terrain_frame(terrain, &input, last), "frame");
        if (frame % 10 == 9) {
            ovf_ground newer;
            must(ovf_terrain_ground(terrain, &newer), "ground");
            ovf_ground older = {atomic_exchange(&shared->ground, newer.bits)};
            if (older.bits != 0) {
                must(ovf_ground_destroy(older), "destroying the older ground");
            }
        }
    }
}

int main(int count, char **words) {
    int frames = count > 1 ? atoi(words[1]) : 300;
    if (frames < 10) {
        fprintf(stderr, "usage: flight [frames, 10 or more]\n");
        return 2;
    }
    ovf_scene scene = {.struct_size = sizeof scene, .preset = "small"};
    ovf_host host = {.struct_size = sizeof host,
                     .workers = OVF_WORKERS_OWN,
                     .worker_count = 1,
                     .pages = OVF_PAGES_WAITED};
    ovf_terrain terrain;
    must(ovf_terrain_new_v1(&scene, &host, &terrain), "opening `small`");

    Shared shared;
    memset(&shared, 0, sizeof shared);
    pthread_t asker;
    if (pthread_create(&asker, NULL, ask, &shared) != 0) {
        return 1;
    }
    ovf_frame last = {.struct_size = sizeof last};
    fly(terrain, frames, &shared, &last);
    while (atomic_load(&shared.answered) == 0) {
        /* The asker gets at least one turn, however short the flight was. */
    }
    atomic_store(&shared.stops, 1);
    pthread_join(asker, NULL);

    must(ovf_ground_destroy((ovf_ground){atomic_load(&shared.ground)}), "destroying the ground");
    must(ovf_terrain_destroy(terrain), "destroying the terrain");
    printf("frames    %d\n", frames);
    printf("triangles %u\n", last.triangles);
    printf("pages     %u\n", last.pages);
    printf("drawn     %u patches\n", last.drawn);
    printf("error     at most %.3f px\n", last.error_px_bound);
    printf("digest    %016llx\n", (unsigned long long)last.digest);
    fprintf(stderr, "%lu heights were answered meanwhile\n", atomic_load(&shared.answered));
    return 0;
}
