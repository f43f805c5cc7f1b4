// rtc-stress: random scenes, changed and traced step after step, against an exact reference on the host.
#include <chrono>
#include <cstdio>
#include <fstream>
#include <nlohmann/json.hpp>

#include "command_line.h"
#include "error.h"
#include "world.h"

using namespace rtc;

namespace {

struct Options {
    uint64_t seed = 1, steps = 25, seeds = 1;
    stress::Limits limits;
    uint64_t heap_mb = 1024;
    uint32_t step_budget = RTR_DEFAULT;
    std::string device, json, addressing = "heap";
    bool validate = false, quiet = false;
    double seconds = 0;
};

nlohmann::ordered_json report(const stress::Counts& c) {
    return {{"steps", c.steps},
            {"rays", c.rays},
            {"hits", c.hits},
            {"reference tests", c.tests},
            {"steps by brute force", c.brute_steps},
            {"bottom level builds", c.builds},
            {"updates", c.updates},
            {"clones", c.clones},
            {"compactions", c.compactions},
            {"serialisations", c.serialisations},
            {"top level builds", c.top_builds},
            {"top level updates", c.top_updates},
            {"destroyed", c.evictions},
            {"most primitives", c.most_primitives},
            {"most instances", c.most_instances},
            {"candidates", c.candidates},
            {"candidates within the error bound", c.undecided},
            {"results they decided, as exact arithmetic", c.undecided_agree},
            {"results they decided, otherwise", c.undecided_differ}};
}

void add(stress::Counts& sum, const stress::Counts& c) {
    sum.steps += c.steps;
    sum.builds += c.builds;
    sum.updates += c.updates;
    sum.clones += c.clones;
    sum.compactions += c.compactions;
    sum.serialisations += c.serialisations;
    sum.top_builds += c.top_builds;
    sum.top_updates += c.top_updates;
    sum.evictions += c.evictions;
    sum.rays += c.rays;
    sum.hits += c.hits;
    sum.tests += c.tests;
    sum.brute_steps += c.brute_steps;
    sum.candidates += c.candidates;
    sum.undecided += c.undecided;
    sum.undecided_agree += c.undecided_agree;
    sum.undecided_differ += c.undecided_differ;
    sum.most_primitives = std::max(sum.most_primitives, c.most_primitives);
    sum.most_instances = std::max(sum.most_instances, c.most_instances);
}

int run(const Options& options) {
    tools::ContextOptions context_options;
    context_options.device = options.device;
    context_options.validate = options.validate;
    const bool addresses = options.addressing == "address";
    context_options.all_core_features = addresses;
    const tools::Context context(context_options);
    stress::Device device(context, addresses, options.step_budget);
    const auto start = std::chrono::steady_clock::now();
    auto elapsed = [&] {
        return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    };
    stress::Counts sum;
    uint64_t seed = options.seed, done = 0;
    bool time_is_up = false;
    for (; seed < options.seed + options.seeds && !time_is_up; ++seed) {
        stress::World world(device, options.limits, seed);
        for (uint64_t i = 0; i < options.steps && !time_is_up; ++i) {
            try {
                world.step();
                if (!options.quiet) std::printf("%s\n", world.describe_step().c_str());
            } catch (const std::exception& e) {
                throw tools::Error("seed " + std::to_string(seed) + ", " + e.what());
            }
            time_is_up = options.seconds > 0 && elapsed() > options.seconds;
        }
        world.finish();
        add(sum, world.counts());
        ++done;
        if (!options.quiet)
            std::printf("seed %llu: %llu steps, %.1f s so far\n", static_cast<unsigned long long>(seed),
                        static_cast<unsigned long long>(sum.steps), elapsed());
        std::fflush(stdout);
    }
    const long long leaked = device.close();
    nlohmann::ordered_json json = report(sum);
    json["device"] = tools::describe_device(context.properties, context.driver);
    json["addressing"] = options.addressing;
    json["first seed"] = options.seed;
    json["seeds"] = done;
    json["differences"] = 0;
    json["host allocations not freed"] = leaked;
    json["seconds"] = elapsed();
    std::printf("%s\n", json.dump(2).c_str());
    if (!options.json.empty()) {
        std::ofstream file(options.json);
        file << json.dump(2) << "\n";
        if (!file) throw tools::Error("cannot write " + options.json);
    }
    if (leaked)
        throw tools::Error(std::to_string(leaked) + " host allocations of the runtime were not freed");
    context.require_silent_validation();
    return 0;
}

}  // namespace

int main(int argc, char** argv) {
    CLI::App app{
        "Random acceleration structures, built, updated, copied, compacted and serialised, and traced after "
        "each step; every result is compared with an exact reference on the host.",
        "rtc-stress"};
    Options options;
    app.add_option("--seed", options.seed, "the first seed");
    app.add_option("--seeds", options.seeds, "how many seeds, each a world of its own");
    app.add_option("--steps", options.steps, "steps of each seed");
    app.add_option("--max-primitives", options.limits.primitives, "of all bottom levels together");
    app.add_option("--max-instances", options.limits.instances, "of the top level");
    app.add_option("--large", options.limits.large,
                   "share of new bottom levels that take more than half of the primitives left")
        ->check(CLI::Range(0.0, 1.0));
    app.add_option("--rays", options.limits.rays, "of a step")->check(CLI::Range(1u, stress::kMostRays));
    app.add_option(
        "--brute", options.limits.brute_tests,
        "steps whose rays need no more primitive tests are checked without the reference's own tree");
    app.add_option("--heap-mb", options.heap_mb, "memory of the acceleration structures")
        ->check(CLI::Range(16, 65536));
    app.add_option("--seconds", options.seconds, "stop after this time");
    app.add_option("--addressing", options.addressing, "how structures are reached")
        ->check(CLI::IsMember({"heap", "address"}));
    app.add_option("--step-budget", options.step_budget,
                   "loop turns before a lane suspends, 0: never; otherwise as the device recommends, or 131072");
    app.add_option("--device", options.device, "a part of the device's name, or its number");
    app.add_option("--json", options.json, "write the counts there too");
    app.add_flag("--validate", options.validate, "under the validation layers, synchronisation included");
    app.add_flag("--quiet", options.quiet, "print the counts only");
    if (const int status = tools::parse_command_line(app, "rtc-stress", argc, argv); status >= 0) return status;
    options.limits.heap_bytes = options.heap_mb << 20;
    return tools::run_program("rtc-stress", [&] { return run(options); });
}
