#include "recorded.h"

#include <cstring>

#include "classify.h"
#include "comparison.h"
#include "native_renderer.h"
#include "progress.h"

namespace rtc::tools {
namespace {

std::vector<LoggedRay> read_log(const Context& context, const RenderJob& job) {
    const std::vector<uint8_t> bytes = download_buffer(context, job.ray_log);
    std::vector<LoggedRay> records(bytes.size() / sizeof(LoggedRay));
    std::memcpy(records.data(), bytes.data(), records.size() * sizeof(LoggedRay));
    return records;
}

}  // namespace

static_assert(sizeof(LoggedRay) == 48);

Recorded compare_recorded(const RtcDevice& device, const Scene& scene, const RenderOptions& options) {
    const Context& context = device.context;
    RenderOptions wanted = options;
    wanted.settings.log_rays = true;
    wanted.quiet = true;
    RenderJob native_job(context, scene, wanted.settings), our_job(context, scene, wanted.settings);
    RenderResult native, ours;
    NativePasses native_passes(context, scene, native_job, wanted.settings.ext_dialect, native);
    RtcPasses our_passes(device, scene, our_job, wanted, ours);

    const Judge judge(scene);
    glm::vec3 low, high;
    scene.bounds(low, high);
    Classification sum;
    std::vector<uint8_t> partings(size_t(wanted.settings.width) * wanted.settings.height);
    Progress progress("recording and judging", options.samples, options.quiet);
    for (uint32_t sample = 0; sample < options.samples; ++sample) {
        native_passes.launch(sample);
        our_passes.launch(sample, 1);
        sum.add(classify(judge, double(glm::length(high - low)), read_log(context, native_job),
                         read_log(context, our_job), our_job.log_places, partings));
        progress.update(sample + 1, double(sum.rays));
    }
    progress.finish(double(sum.rays));
    native.picture = native_job.picture(context, options.samples);
    ours.picture = our_job.picture(context, options.samples);
    const Comparison comparison = compare(native, ours);
    const DifferingPixels pixels = sort_pixels(comparison.differences, 1e-3, partings);

    Recorded result;
    result.text = "with recorded rays:\n" + as_text(comparison) + as_text(sum) + as_text(pixels);
    result.json = "\"recorded_pictures\": " + as_json(comparison) + ",\n \"classification\": " + as_json(sum) +
                  ",\n \"differing_pixels\": " + as_json(pixels);
    result.passed = comparison.passed() && sum.ours_wrong + sum.both_wrong == 0;
    result.text += result.passed ? "classify: passed\n" : "classify: FAILED\n";
    return result;
}

}  // namespace rtc::tools
