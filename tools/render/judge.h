// What exact arithmetic says about a ray that two ways of tracing answered differently.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <memory>
#include <string>

#include "scene.h"

namespace rtc::tools {

struct JudgedRay {
    glm::vec3 origin{0}, direction{0};
    float end = 0;  // hits count for 0 < t < end
};

constexpr uint32_t kNothing = ~0u;

struct Answer {
    uint32_t instance = kNothing, primitive = 0;  // instance kNothing: the ray misses
};

// Exact: what rational arithmetic on the ray and the transformed triangles says.
// Tie: rational arithmetic puts the answer on a par with another one: equal t, or only edges and vertices
//      are touched.
// Rounding: some ray that differs from this one by no more than the rounding of its transform into the
//      instance and of the intersection test (Judge::bound) has this answer.
// Wrong: none of them has.
enum class Ruling { Exact, Tie, Rounding, Wrong };
const char* ruling_name(Ruling ruling);

// Thread-safe after construction. Triangles only, nothing culled, all masks pass.
class Judge {
  public:
    explicit Judge(const Scene& scene);
    ~Judge();
    Judge(const Judge&) = delete;
    Judge& operator=(const Judge&) = delete;

    Answer nearest(const JudgedRay& ray) const;  // by rational arithmetic
    Ruling closest(const JudgedRay& ray, const Answer& answer) const;
    // `open`: nothing was found between the ends.
    Ruling shadow(const JudgedRay& ray, bool open) const;

    // How far arithmetic in floats may displace the ray, in the instance's space: 16 u of the magnitudes
    // that the transform of the origin, of the direction and the test's own differences go through. The
    // transform takes (1 + 4) u each with its correctly rounded inverse, Woop's translation and shear 4 u,
    // in each of three coordinates: sqrt(3) * 5 u < 9 u, and divisions may be off by 2.5 ulp.
    double bound(const JudgedRay& ray, uint32_t instance) const;
    // How far apart, across the ray, two points of one triangle are (weights of its second and third
    // corner), in bounds.
    double apart(const JudgedRay& ray, const Answer& where, const glm::vec2& a, const glm::vec2& b) const;

  private:
    struct Parts;
    std::unique_ptr<Parts> parts_;
};

}  // namespace rtc::tools
