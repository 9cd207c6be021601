/* JSBSim on overfly's ground: a subclass of its FGGroundCallback. Built where its headers are.
 *
 * In:    JSBSim's folder with aircraft, and a scene file or the name of a preset.
 * Out:   a C172 that is dropped from 5 ft and comes to rest: its height above ground each second.
 * Keeps: nothing.
 * Not here: the mapping itself (gear_ground.hpp), which contacts.cpp checks without JSBSim.
 */

#include "gear_ground.hpp"

#include <FGFDMExec.h>
#include <initialization/FGInitialCondition.h>
#include <input_output/FGGroundCallback.h>
#include <math/FGColumnVector3.h>
#include <math/FGLocation.h>
#include <models/FGInertial.h>
#include <models/FGPropagate.h>
#include <simgear/misc/sg_path.hxx>

#include <cstdio>
#include <thread>

namespace {

/* Wavelengths down to a metre or two on the Earth. */
constexpr std::uint32_t LEVEL = 44;

class OverflyGround : public JSBSim::FGGroundCallback {
public:
    OverflyGround(ovf_ground snapshot, double a_ft, double b_ft)
        : ground_(snapshot, LEVEL), a_ft_(a_ft), b_ft_(b_ft) {}

    using JSBSim::FGGroundCallback::GetAGLevel;

    double GetAGLevel(double, const JSBSim::FGLocation &location, JSBSim::FGLocation &contact,
                      JSBSim::FGColumnVector3 &normal, JSBSim::FGColumnVector3 &velocity,
                      JSBSim::FGColumnVector3 &angular) const override {
        const gear::Contact found = ground_.under({location(1), location(2), location(3)});
        if (!found.known) {
            /* JSBSim has no word for that, and any number would be a lie. */
            throw std::runtime_error("no ground is loaded under the aircraft");
        }
        const auto vector = [](const gear::Triple &from) {
            return JSBSim::FGColumnVector3(from[0], from[1], from[2]);
        };
        contact = JSBSim::FGLocation(vector(found.contact_ft));
        contact.SetEllipse(a_ft_, b_ft_);
        normal = vector(found.normal);
        velocity = vector(found.velocity_fps);
        angular = vector(found.angular_rad_s);
        return found.agl_ft;
    }

private:
    gear::Ground ground_;
    double a_ft_, b_ft_;
};

ovf_ground ground_around(ovf_terrain terrain, double lat_rad, double lon_rad) {
    ovf_region region{};
    region.struct_size = sizeof region;
    region.centre_lat_rad = lat_rad;
    region.centre_lon_rad = lon_rad;
    region.radius_m = 300.0;
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

/* A minute on the brakes. JSBSim is gone when it returns: it asks for its height above ground until the
 * very end, so the snapshot must outlive it. */
int park(const char *root, ovf_ground ground, double lat_rad, double lon_rad) {
    JSBSim::FGFDMExec fdm;
    fdm.SetRootDir(SGPath(root));
    fdm.SetAircraftPath(SGPath("aircraft"));
    fdm.SetEnginePath(SGPath("engine"));
    fdm.SetSystemsPath(SGPath("systems"));
    if (!fdm.LoadModel("c172x")) {
        return 1;
    }
    /* JSBSim owns its callback. It comes after the model, which begins where no ground is loaded. */
    const auto inertial = fdm.GetInertial();
    inertial->SetGroundCallback(
        new OverflyGround(ground, inertial->GetSemimajor(), inertial->GetSemiminor()));
    const auto start = fdm.GetIC();
    start->SetGeodLatitudeRadIC(lat_rad);
    start->SetLongitudeRadIC(lon_rad);
    start->SetAltitudeAGLFtIC(5.0);
    if (!fdm.RunIC()) {
        return 1;
    }
    fdm.SetPropertyValue("fcs/left-brake-cmd-norm", 1.0);
    fdm.SetPropertyValue("fcs/right-brake-cmd-norm", 1.0);
    fdm.Setdt(1.0 / 120.0);
    for (int step = 0; step < 60 * 120; step++) {
        fdm.Run();
        if (step % 120 == 119) {
            std::printf("%3d s  %8.4f ft above ground\n", step / 120 + 1,
                        fdm.GetPropagate()->GetDistanceAGL());
        }
    }
    return 0;
}

} // namespace

int main(int count, char **words) try {
    if (count != 3) {
        std::fprintf(stderr, "usage: jsbsim_ground JSBSIM_ROOT SCENE_OR_PRESET\n");
        return 2;
    }
    const std::string scene_name = words[2];
    const bool is_preset = scene_name == "earth" || scene_name == "moon" || scene_name == "small";
    ovf_scene scene{};
    scene.struct_size = sizeof scene;
    (is_preset ? scene.preset : scene.path) = scene_name.c_str();
    ovf_terrain terrain{};
    gear::must(ovf_terrain_new_v1(&scene, nullptr, &terrain));
    const double lat_rad = 0.8, lon_rad = 0.2;
    const ovf_ground ground = ground_around(terrain, lat_rad, lon_rad);
    const int code = park(words[1], ground, lat_rad, lon_rad);
    gear::must(ovf_ground_destroy(ground));
    gear::must(ovf_terrain_destroy(terrain));
    return code;
} catch (const std::exception &error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
}
