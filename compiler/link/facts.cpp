// What a pipeline's code proves, and what its user promises, about rays and scenes.
#include <algorithm>
#include <array>
#include <cstdio>

#include "link/link.h"
#include "rtc/abi.h"

namespace rtc {

namespace {

// A bit of RTC_FACT_*; where it says that something is present, the assumption is that it is not.
constexpr std::array<Assumption, 7> kAssumptions = {{
    {"opaque", RTC_FACT_ALL_OPAQUE},
    {"single-level", RTC_FACT_SINGLE_LEVEL},
    {"identity-transforms", RTC_FACT_IDENTITY_TRANSFORMS},
    {"no-masks", RTC_FACT_FULL_MASKS},
    {"no-instance-flags", RTC_FACT_NO_INSTANCE_FLAGS},
    {"triangles", RTC_FACT_HAS_AABBS},
    {"aabbs", RTC_FACT_HAS_TRIANGLES},
}};

}  // namespace

bool LinkOptions::ignores(std::string_view fact) const {
    return std::find(ignored_facts.begin(), ignored_facts.end(), fact) != ignored_facts.end();
}

std::span<const Assumption> assumptions() { return kAssumptions; }

bool assumption_from_name(std::string_view name, uint32_t& bit) {
    for (const Assumption& known : kAssumptions)
        if (name == known.name) {
            bit = known.bit;
            return true;
        }
    return false;
}

std::vector<std::string> assumption_names(uint32_t bits) {
    std::vector<std::string> names;
    for (const Assumption& known : kAssumptions)
        if (bits & known.bit) names.push_back(known.name);
    return names;
}

namespace link {
namespace {

// Ray flags, SPV_KHR_ray_tracing.
struct Flag {
    uint32_t bit;
    const char* name;
};
constexpr Flag kFlags[] = {
    {1, "Opaque"},          {2, "NoOpaque"},       {4, "TerminateOnFirstHit"},
    {8, "SkipClosestHitShader"}, {16, "CullBackFacingTriangles"}, {32, "CullFrontFacingTriangles"},
    {64, "CullOpaque"},     {128, "CullNoOpaque"}, {256, "SkipTriangles"},
    {512, "SkipAABBs"},
};
constexpr uint32_t kAllFlags = 1023;

constexpr const char* kIgnored = "known, but left out on request";

std::string flag_names(uint32_t bits) {
    std::string out;
    for (const Flag& flag : kFlags)
        if (bits & flag.bit) out += (out.empty() ? "" : "|") + std::string(flag.name);
    return out.empty() ? "none" : out;
}

}  // namespace

void collect_trace_facts(const Program& program, const lower::Stage& stage, TraceFacts& facts,
                         BitAnalysis::Tables& tables) {
    std::vector<const ir::Function*> functions{&stage.body};
    for (const ir::Function& function : stage.functions) functions.push_back(&function);
    // Module-scope variables may be payloads, which others write.
    BitAnalysis bits(program, functions, {}, false, tables);
    for (const ir::Block& block : stage.body.blocks)
        for (const Inst& inst : block.insts) {
            if (!lower::is_trace(inst.op)) continue;
            auto add = [&](Bits& known, Id operand, uint32_t counted) {
                Bits one = bits.of(operand);
                one.zeros |= ~counted;  // operand bits that do not count are dropped where the trace begins
                one.ones &= counted;
                known = facts.sites ? both(known, one) : one;
            };
            add(facts.flags, inst.ops[1], 0xffffffffu);
            add(facts.mask, inst.ops[2], 0xffu);
            add(facts.offset, inst.ops[3], 0xfu);
            add(facts.stride, inst.ops[4], 0xfu);
            add(facts.miss, inst.ops[5], 0xffffu);
            ++facts.sites;
        }
}

Needs scene_needs(const LinkOptions& options) {
    Needs needs;
    auto open = [&](const char* fact, uint32_t bits) {
        return !options.specialize || !(options.assumptions & bits) || options.ignores(fact);
    };
    needs.mixed = open("no procedural geometry", RTC_FACT_HAS_AABBS) &&
                  open("only procedural geometry", RTC_FACT_HAS_TRIANGLES);
    needs.non_opaque = open("opaque", RTC_FACT_ALL_OPAQUE);
    needs.masks = open("no-masks", RTC_FACT_FULL_MASKS);
    needs.instance_flags = open("no-instance-flags", RTC_FACT_NO_INSTANCE_FLAGS);
    needs.transforms = open("identity-transforms", RTC_FACT_IDENTITY_TRANSFORMS);
    needs.levels = open("single-level", RTC_FACT_SINGLE_LEVEL);
    return needs;
}

Needs decide(const TraceFacts& traces, const PipelineShape& shape, const LinkOptions& options,
             std::vector<FactReport>& reports) {
    Needs needs = scene_needs(options);
    auto assumed = [&](uint32_t bit) { return (options.assumptions & bit) != 0; };
    auto report = [&](const char* name, const char* state, std::string detail) {
        reports.push_back({name, state, std::move(detail)});
    };
    if ((options.assumptions & RTC_FACT_HAS_TRIANGLES) && (options.assumptions & RTC_FACT_HAS_AABBS))
        ir::fail("assumption-conflict", "", 0,
                 "'triangles' and 'aabbs' cannot both be assumed: a scene of neither has nothing to hit");
    if (!traces.sites) {
        needs.any_hit = shape.has_any_hit;
        needs.aabbs = shape.has_intersection;
        report("traces", "proven", "none: nothing is traced");
        return needs;
    }
    const Bits flags = options.specialize ? traces.flags : Bits{};
    if (!options.specialize) {
        needs.any_hit = shape.has_any_hit;
        needs.aabbs = shape.has_intersection;
        return needs;
    }

    // ---- shaders ----
    needs.any_hit = false;
    if (!shape.has_any_hit)
        report("no any-hit", "proven", "the pipeline has no any-hit shader: every candidate triangle is a hit");
    else if (options.ignores("no any-hit")) {
        needs.any_hit = true;
        report("no any-hit", "unknown", kIgnored);
    } else if (flags.ones & 1)
        report("no any-hit", "proven", "every trace has the ray flag Opaque: any-hit shaders are not linked");
    else if (flags.ones & 128)
        report("no any-hit", "proven", "every trace has the ray flag CullNoOpaque: any-hit shaders are not linked");
    else if (assumed(RTC_FACT_ALL_OPAQUE) && (flags.zeros & 2))
        report("no any-hit", "assumed", "'opaque', and no trace has the ray flag NoOpaque: any-hit shaders are not linked");
    else {
        needs.any_hit = true;
        report("no any-hit", "unknown",
               assumed(RTC_FACT_ALL_OPAQUE) ? "a trace may have the ray flag NoOpaque" : "geometry may be not opaque");
    }

    needs.aabbs = false;
    if (!shape.has_intersection)
        report("no procedural geometry", "proven",
               assumed(RTC_FACT_HAS_AABBS)
                   ? "the pipeline has no intersection shader, and 'triangles': whether instances hold AABBs is not asked"
                   : "the pipeline has no intersection shader: AABBs are never hit");
    else if (options.ignores("no procedural geometry")) {
        needs.aabbs = true;
        report("no procedural geometry", "unknown", kIgnored);
    } else if (flags.ones & 512)
        report("no procedural geometry", "proven", "every trace has the ray flag SkipAABBs: intersection shaders are not linked");
    else if (assumed(RTC_FACT_HAS_AABBS))
        report("no procedural geometry", "assumed", "'triangles': intersection shaders are not linked");
    else {
        needs.aabbs = true;
        report("no procedural geometry", "unknown", "the pipeline has intersection shaders");
    }

    needs.triangles = false;
    if (options.ignores("only procedural geometry")) {
        needs.triangles = true;
        report("only procedural geometry", "unknown", kIgnored);
    } else if (flags.ones & 256)
        report("only procedural geometry", "proven", "every trace has the ray flag SkipTriangles: no triangle test");
    else if (assumed(RTC_FACT_HAS_TRIANGLES))
        report("only procedural geometry", "assumed", "'aabbs': no triangle test");
    else {
        needs.triangles = true;
        report("only procedural geometry", "unknown", "a scene may hold triangles");
    }

    // ---- operands of traces ----
    const uint32_t known = (flags.zeros | flags.ones) & kAllFlags;
    if (options.ignores("ray flags"))
        report("ray flags", "unknown", kIgnored);
    else if (known == kAllFlags)
        report("ray flags", "proven", "constant at every trace: " + flag_names(flags.ones & kAllFlags));
    else if (known)
        report("ray flags", "proven", "in part: never " + flag_names(flags.zeros & kAllFlags) + "; always " +
                                          flag_names(flags.ones & kAllFlags));
    else
        report("ray flags", "unknown", "known only when tracing");
    auto operand = [&](const char* name, Bits bits) {
        char text[64];
        std::snprintf(text, sizeof text, "constant at every trace: %u", bits.ones);
        const bool constant = bits.constant(0xffffffffu) && !options.ignores(name);
        report(name, constant ? "proven" : "unknown", constant ? text : "differs between traces, or known only when tracing");
    };
    operand("cull mask", traces.mask);
    operand("SBT record offset", traces.offset);
    operand("SBT record stride", traces.stride);
    operand("miss index", traces.miss);
    report("no shader records", shape.records ? "unknown" : "proven",
           shape.records ? "shaders read their records" : "no shader reads its record: where it lies is not kept");
    report("recursion depth", "proven",
           shape.nested ? "at most " + std::to_string(shape.recursion_depth) + " traces nested"
                        : "1: only ray generation shaders trace, no stack");

    // ---- the scene ----
    auto scene = [&](const char* name, bool need, const char* removed, const char* why) {
        report(name, need ? "unknown" : "assumed", need ? why : removed);
    };
    scene("opaque", needs.non_opaque, "opacity of geometries and instances is not looked at",
          "opacity is looked up for each candidate");
    scene("single-level", needs.levels, "the top level is not walked",
          "top levels may have any number of instances");
    scene("identity-transforms", needs.transforms, "rays are not transformed",
          "instances may be transformed");
    scene("no-masks", needs.masks, "instance masks are not looked at",
          "instances may be masked");
    scene("no-instance-flags", needs.instance_flags, "instance flags are not looked at",
          "instances may have flags");
    return needs;
}

}  // namespace link
}  // namespace rtc
