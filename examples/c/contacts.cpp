/* The wheels of an aircraft on the ground of the planet `small`, as JSBSim would ask.
 *
 * In:    nothing.
 * Out:   a line a wheel: height above ground in feet, how steep it is there; exit code 1 where the
 *        numbers contradict each other.
 * Keeps: nothing.
 * Not here: JSBSim itself (jsbsim_ground.cpp).
 */

#include "gear_ground.hpp"

#include <cmath>
#include <cstdio>
#include <thread>

namespace {

constexpr std::uint32_t LEVEL = 16;

/* Loads all ground within 50 m of a place at LEVEL and gives a snapshot of it. */
ovf_ground ground_around(ovf_terrain terrain, double lat_rad, double lon_rad) {
    ovf_region region{};
    region.struct_size = sizeof region;
    region.centre_lat_rad = lat_rad;
    region.centre_lon_rad = lon_rad;
    region.radius_m = 50.0;
    std::uint64_t ticket = 0;
    gear::must(ovf_terrain_request(terrain, &region, LEVEL, &ticket));
    ovf_readiness readiness{};
    readiness.struct_size = sizeof readiness;
    do {
        std::this_thread::yield();
        gear::must(ovf_terrain_readiness(terrain, &region, LEVEL, &readiness));
    } while (readiness.fraction < 1.0);
    ovf_ground ground{};
    gear::must(ovf_terrain_ground(terrain, &ground));
    return ground;
}

bool is_close(double a, double b) { return std::abs(a - b) < 1e-6; }

/* Looks at one wheel, 2 m up and 2 m under ground. */
bool wheel(ovf_ground snapshot, const char *name, double lat_rad, double lon_rad) {
    const gear::Ground ground(snapshot, LEVEL);
    gear::Triple point_m{};
    gear::must(ovf_ground_to_ecef(snapshot, lat_rad, lon_rad, 0.0, point_m.data()));
    gear::Triple point_ft{};
    for (std::size_t i = 0; i < 3; i++) {
        point_ft[i] = point_m[i] / gear::METRES_PER_FOOT;
    }
    const gear::Contact below = ground.under(point_ft);
    if (!below.known) {
        std::printf("%-6s nothing is known there\n", name);
        return false;
    }
    const double ground_ft = -below.agl_ft;
    bool right = true;
    for (const double up_ft : {6.5, -6.5}) {
        const double height_m = (ground_ft + up_ft) * gear::METRES_PER_FOOT;
        gear::must(ovf_ground_to_ecef(snapshot, lat_rad, lon_rad, height_m, point_m.data()));
        for (std::size_t i = 0; i < 3; i++) {
            point_ft[i] = point_m[i] / gear::METRES_PER_FOOT;
        }
        const gear::Contact contact = ground.under(point_ft);
        double steep = 0.0;
        double away_ft = 0.0;
        for (std::size_t i = 0; i < 3; i++) {
            steep += contact.normal[i] * point_ft[i];
            away_ft += std::pow(contact.contact_ft[i] - point_ft[i], 2.0);
            right = right && contact.velocity_fps[i] == 0.0 && contact.angular_rad_s[i] == 0.0;
        }
        right = right && contact.known && is_close(contact.agl_ft, up_ft) &&
                is_close(std::sqrt(away_ft), std::abs(up_ft));
        const double radius_ft = std::sqrt(point_ft[0] * point_ft[0] + point_ft[1] * point_ft[1] +
                                           point_ft[2] * point_ft[2]);
        std::printf("%-6s agl %8.4f ft, ground %9.3f ft, cosine of the slope %.4f\n", name,
                    contact.agl_ft, ground_ft, steep / radius_ft);
    }
    return right;
}

} // namespace

int main() try {
    ovf_scene scene{};
    scene.struct_size = sizeof scene;
    scene.preset = "small";
    ovf_terrain terrain{};
    gear::must(ovf_terrain_new_v1(&scene, nullptr, &terrain));
    const double lat_rad = 0.25, lon_rad = 0.3, metre_rad = 1.0 / 1000.0;
    const ovf_ground ground = ground_around(terrain, lat_rad, lon_rad);
    /* A snapshot outlives its terrain. */
    gear::must(ovf_terrain_destroy(terrain));
    bool right = wheel(ground, "nose", lat_rad, lon_rad);
    right = wheel(ground, "left", lat_rad - metre_rad, lon_rad - metre_rad) && right;
    right = wheel(ground, "right", lat_rad - metre_rad, lon_rad + metre_rad) && right;
    gear::must(ovf_ground_destroy(ground));
    return right ? 0 : 1;
} catch (const std::exception &error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
}
