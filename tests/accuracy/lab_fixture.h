// One device for all tests, with validation, and short cuts for small scenes.
#pragma once

#include <gtest/gtest.h>

#include "device_tracer.h"
#include "host_scene.h"

namespace rtc::lab {

const tools::Context& test_context();

inline Ray make_ray(Vec3 origin, Vec3 direction, float tmin = 0.0f, float tmax = 1e30f) {
    Ray ray;
    ray.origin = origin;
    ray.direction = direction;
    ray.tmin = tmin;
    ray.tmax = tmax;
    return ray;
}

// Compiling a pipeline takes longer than most tests: one per set of options.
DeviceTracer& shared_tracer(Variant variant = Variant::Watertight);

class LabTest : public testing::Test {
  protected:
    void TearDown() override {
        const auto& messages = test_context().validation_messages();
        EXPECT_TRUE(messages.empty()) << messages.front();
    }
};

}  // namespace rtc::lab
