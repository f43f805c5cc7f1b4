#include "backend.h"

namespace rtc::run {

Variant variant_of(const std::string& name) {
    if (name == "rtc-nv") return {name, Backend::Rtc, Dialect::AsWritten, {name, "rtc", "nv"}};
    if (name == "rtc-ext") return {name, Backend::Rtc, Dialect::Ext, {name, "rtc", "ext"}};
    if (name == "khr") return {name, Backend::Khr, Dialect::Ext, {name, "native", "native-khr", "ext"}};
    if (name == "nv") return {name, Backend::Nv, Dialect::AsWritten, {name, "native", "native-nv", "nv"}};
    throw tools::Error("unknown variant '" + name + "' (rtc-nv, rtc-ext, khr, nv)");
}

Host::Host(std::set<Backend> backends, const Options& options) {
    tools::ContextOptions context;
    context.device = options.device;
    context.validate = options.validate;
    context.all_core_features = true;
    context.print_device = options.print_device;
    if (options.statistics) tools::want_pipeline_statistics(context, statistics_);
    if (backends.count(Backend::Khr)) khr_.apply(context);
    if (backends.count(Backend::Nv)) nv_.apply(context);
    context_ = std::make_unique<native::Context>(context);
    if (backends.count(Backend::Rtc)) rtc_ = std::make_unique<RtcDevice>(*context_);
}

RunResult Host::run(Backend backend, const Job& job, const RtcOptions& options, unsigned repeats) {
    std::unique_ptr<native::Executor> executor;
    switch (backend) {
        case Backend::Rtc: {
            RtcOptions chosen = options;
            if (!job.addressing.empty()) chosen.addressing = tools::addressing_from_name(job.addressing);
            if (!job.assume.empty()) chosen.assume = job.assume;
            executor = make_rtc(*rtc_, chosen);
            break;
        }
        case Backend::Khr:
            executor = native::make_khr(*context_);
            break;
        case Backend::Nv:
            executor = native::make_nv(*context_);
            break;
    }
    RunResult result = run_job(*context_, *executor, job, repeats);
    return result;
}

}  // namespace rtc::run
