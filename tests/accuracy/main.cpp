#include <cstdio>
#include <map>
#include <memory>

#include "lab_fixture.h"

namespace rtc::lab {
namespace {

std::unique_ptr<tools::Context> context;
std::map<Variant, std::unique_ptr<DeviceTracer>> tracers;

}  // namespace

const tools::Context& test_context() {
    if (!context) {
        tools::ContextOptions options;
        options.validate = true;
        options.all_core_features = true;  // Float64 for the negative control
        context = std::make_unique<tools::Context>(options);
    }
    return *context;
}

DeviceTracer& shared_tracer(Variant variant) {
    auto& tracer = tracers[variant];
    if (!tracer) {
        TracerOptions options;
        options.variant = variant;
        // lavapipe 22.3 ends loops after 65 535 turns, which exact decisions of a whole group can take:
        // as on any pipeline there, lanes suspend in time. (Of 7000, the longest decision is kept in reserve.)
        if (variant == Variant::Exact || variant == Variant::Exact64) {
            options.step_budget = 7000;
            options.pause = true;
        }
        tracer = std::make_unique<DeviceTracer>(test_context(), options);
    }
    return *tracer;
}

}  // namespace rtc::lab

int main(int argc, char** argv) {
    testing::InitGoogleTest(&argc, argv);
    int result = RUN_ALL_TESTS();
    rtc::lab::tracers.clear();
    if (rtc::lab::context && !rtc::lab::context->validation_messages().empty()) {
        std::fprintf(stderr, "the validation layers spoke: see above\n");
        result = 1;
    }
    rtc::lab::context.reset();
    return result;
}
