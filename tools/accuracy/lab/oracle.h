// What tier `exact` promises, computed on the host: the first hit of exact
// arithmetic under the rules of compiler/traversal/glsl/exact.glsl. Fast enough
// to keep up with a device: it walks the scene's own trees in double, decides
// what double can prove and leaves the rest to rationals.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include "device_tracer.h"
#include "host_scene.h"

namespace rtc::lab {

struct OracleHit {
    uint32_t instance = 0, geometry = 0, primitive = 0;
    double t = 0;         // nearest double or its neighbour, in the ray's own units
    bool tied = false;    // another triangle at the same exact t lost by its number
    bool on_edge = false; // the ray met an edge or vertex of some triangle exactly
};

// Triangle tests; what double could not prove, of edges and of orders; what 128-bit integers could not hold.
struct OracleCounts {
    uint64_t tests = 0, edges = 0, orders = 0, rationals = 0;
    void add(const OracleCounts& more) {
        tests += more.tests;
        edges += more.edges;
        orders += more.orders;
        rationals += more.rationals;
    }
};

class Oracle {
  public:
    // The scene must outlive the oracle; triangles only.
    explicit Oracle(const HostScene& scene) : scene_(scene) {}

    // Thread-safe but for `counts`. Flags and masks of the ray are not looked at.
    std::optional<OracleHit> first_hit(const Ray& ray, OracleCounts* counts = nullptr) const;

  private:
    const HostScene& scene_;
};

// Calls work(begin, end) for parts of 0 .. count on `threads` threads, 0: as many as there are cores.
void in_parallel(size_t count, const std::function<void(size_t begin, size_t end)>& work, unsigned threads = 0);

// first_hit of all rays.
std::vector<std::optional<OracleHit>> first_hits(const Oracle& oracle, const std::vector<Ray>& rays,
                                                 OracleCounts* counts = nullptr, unsigned threads = 0);

}  // namespace rtc::lab
