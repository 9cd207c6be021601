/* The ground as JSBSim's FGGroundCallback has it, in feet: shared by contacts.cpp and
 * jsbsim_ground.cpp, and without a header of JSBSim's.
 *
 * In:    a snapshot of the ground; body-fixed points in feet.
 * Out:   height above ground, contact, normal, velocity; or that nothing is known.
 * Keeps: the snapshot's handle, which is not its own.
 * Not here: when to take a new snapshot.
 */

#ifndef GEAR_GROUND_HPP
#define GEAR_GROUND_HPP

#include "overfly.h"

#include <array>
#include <stdexcept>
#include <string>

namespace gear {

constexpr double METRES_PER_FOOT = 0.3048;

using Triple = std::array<double, 3>;

/* An overfly call that failed, in its own words. */
inline void must(ovf_status status) {
    if (status != OVF_OK) {
        throw std::runtime_error(std::string("overfly: ") + ovf_last_error());
    }
}

/* What JSBSim's GetAGLevel gives for one wheel. */
struct Contact {
    bool known = false;       /* false: no page of that place is there; the rest is 0 */
    double agl_ft = 0.0;      /* along the vertical; negative below ground */
    Triple contact_ft{};      /* where the vertical meets the ground, body-fixed */
    Triple normal{};          /* outward, body-fixed */
    Triple velocity_fps{};    /* the ground does not move */
    Triple angular_rad_s{};   /* nor turn */
};

/* The ground of one level: what wheels stand on must not change with what is drawn. */
class Ground {
public:
    Ground(ovf_ground snapshot, std::uint32_t level) : snapshot_(snapshot) {
        query_.struct_size = sizeof query_;
        query_.kind = OVF_QUERY_EXACT;
        query_.level = level;
    }

    Contact under(const Triple &point_ft) const {
        Triple point_m;
        for (std::size_t i = 0; i < 3; i++) {
            point_m[i] = point_ft[i] * METRES_PER_FOOT;
        }
        ovf_contact found{};
        found.struct_size = sizeof found;
        must(ovf_ground_contact(snapshot_, point_m.data(), &query_, &found));
        Contact contact;
        /* Coarser ground than asked would move under the wheels when the finer comes. */
        if (found.answer != OVF_ANSWER_OK) {
            return contact;
        }
        contact.known = true;
        contact.agl_ft = found.agl_m / METRES_PER_FOOT;
        for (std::size_t i = 0; i < 3; i++) {
            contact.contact_ft[i] = found.contact_ecef_m[i] / METRES_PER_FOOT;
            contact.normal[i] = found.normal_ecef[i];
        }
        return contact;
    }

private:
    ovf_ground snapshot_;
    ovf_query query_{};
};

} // namespace gear

#endif
