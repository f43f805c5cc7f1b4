// How far the object-space rays that traversal follows are from those of exact arithmetic: the runtime's inverse of
// an instance's transform, applied in floats, against the rational inverse.
#pragma once

#include <string>
#include <vector>

#include "pipeline_tracer.h"

namespace rtc::lab {

// Errors of a component are in steps of 2^-23 (an ulp at most) of what the component is summed from, |W||p| + |w| or
// |W||d|, with W, w the exact inverse.
struct TransformError {
    std::string name;
    double origin = 0, direction = 0;  // largest
    // Largest share of the widening of the instance's box (leaf_instances.comp) that points of the box are moved by,
    // mapped back to the world.
    double of_padding = 0;
};

// With u = 2^-24 a component costs: the inverse's entry u, which leaf_instances.comp computes in pairs of floats and
// rounds once; its product u; three sums 3u for an origin, two for a direction. 5u are 2.5 steps. Terms of second order
// and what the pairs lose (2^-43 of terms that may cancel to 2^-20 of their size): 2^-4 of a step.
constexpr double kTransformBound = 2.5625;

// Of lab_transforms(), axis `transform`: `points` origins and directions each. Sets the tracer's scene.
std::vector<TransformError> measure_transform_errors(PipelineTracer& tracer, unsigned points);

// Their table.
std::string transform_table(const std::vector<TransformError>& errors);

}  // namespace rtc::lab
