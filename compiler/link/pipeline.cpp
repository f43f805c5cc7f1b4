// The journey of a pipeline: every step of link_pipeline, in order, and why that order.
#include <algorithm>
#include <set>

#include "check/check.h"
#include "continuation/machine.h"
#include "ir/cleanup.h"
#include "link/link.h"
#include "lower/stage.h"
#include "rtc/abi.h"
#include "traversal/traversal_modules.h"

namespace rtc {
namespace {

using continuation::Machine;
using ir::Id;
using ir::Inst;
using ir::Op;
using ir::Program;

spv::ExecutionModel execution_model(StageKind kind) {
    switch (kind) {
        case StageKind::RayGen: return spv::ExecutionModel::RayGenerationKHR;
        case StageKind::Intersection: return spv::ExecutionModel::IntersectionKHR;
        case StageKind::AnyHit: return spv::ExecutionModel::AnyHitKHR;
        case StageKind::ClosestHit: return spv::ExecutionModel::ClosestHitKHR;
        case StageKind::Miss: return spv::ExecutionModel::MissKHR;
        case StageKind::Callable: return spv::ExecutionModel::CallableKHR;
    }
    return spv::ExecutionModel::Max;
}

class Linker {
  public:
    Linker(const PipelineInput& input, const LinkOptions& options, LinkResult& result)
        : input_(input), options_(options), result_(result), machine_(program_, options) {}

    void run() {
        check_input();
        machine_.entry_count = static_cast<uint32_t>(input_.stages.size());
        machine_.next_state_id = continuation::kFirstEntry + machine_.entry_count;
        // All stages are read before the first is lowered: how deep calls can nest decides about stacks.
        for (const StageInput& stage : input_.stages) read(stage);
        set_depths();
        import_traversal();
        link::prepare_push_constants(program_, modules_, result_.reflection);
        std::map<uint32_t, uint32_t> spec_ids;
        for (size_t i = 0; i < input_.stages.size(); ++i) add_stage(static_cast<uint32_t>(i), spec_ids);
        check::check_data_types(program_, data_types_, result_.diagnostics);
        decide_needs();
        if (options_.stop_after == "facts") {
            dump_facts();
            return;
        }
        if (options_.stop_after == "split") {
            dump_states();
            return;
        }
        assemble();
        finish();
    }

  private:
    void check_input() {
        if (input_.stages.empty()) ir::fail("pipeline-empty", "", 0, "a pipeline needs at least one stage");
        if (input_.stages.size() > 4000)
            ir::fail("pipeline-too-large", "", 0, "a pipeline of more than 4000 stages is not supported");
        if (!options_.stop_after.empty() && options_.stop_after != "facts" && options_.stop_after != "split" &&
            options_.stop_after != "finish")
            ir::fail("unknown-pass", "", 0,
                     "no pass is called '" + options_.stop_after + "'; text can be had after 'facts', 'split' and 'finish'");
        if (options_.max_recursion_depth > 31)
            ir::fail("recursion-limit", "", 0, "the recursion depth is at most 31");
        bool raygen = false;
        for (const StageInput& stage : input_.stages) raygen |= stage.kind == StageKind::RayGen;
        if (!raygen) ir::fail("pipeline-without-raygen", "", 0, "a pipeline needs a ray generation stage");
        for (const GroupInput& group : input_.groups) {
            auto check = [&](int index, std::initializer_list<StageKind> kinds, const char* what) {
                if (index == -1) return;
                if (index < 0 || index >= static_cast<int>(input_.stages.size()))
                    ir::fail("group-stage", "", 0,
                             "group '" + group.name + "' names stage " + std::to_string(index) + ", there are " +
                                 std::to_string(input_.stages.size()));
                for (StageKind kind : kinds)
                    if (input_.stages[index].kind == kind) return;
                ir::fail("group-stage", "", 0,
                         "group '" + group.name + "' uses " + stage_kind_name(input_.stages[index].kind) +
                             " stage '" + input_.stages[index].name + "' as " + what);
            };
            check(group.general, {StageKind::RayGen, StageKind::Miss, StageKind::Callable}, "a general shader");
            check(group.closest_hit, {StageKind::ClosestHit}, "a closest-hit shader");
            check(group.any_hit, {StageKind::AnyHit}, "an any-hit shader");
            check(group.intersection, {StageKind::Intersection}, "an intersection shader");
            if (group.kind == GroupKind::Procedural && group.intersection < 0 &&
                (group.closest_hit >= 0 || group.any_hit >= 0))
                ir::fail("group-without-intersection", "", 0,
                         "procedural hit group '" + group.name + "' has no intersection shader");
            if (group.kind == GroupKind::Triangles && group.intersection >= 0)
                ir::fail("group-intersection", "", 0,
                         "triangle hit group '" + group.name + "' has an intersection shader");
        }
    }

    bool has(StageKind kind) const {
        return std::any_of(input_.stages.begin(), input_.stages.end(),
                           [&](const StageInput& stage) { return stage.kind == kind; });
    }

    void set_depths() {
        bool& nested = nested_;
        for (size_t i = 0; i < modules_.size(); ++i)
            if (input_.stages[i].kind != StageKind::RayGen)
                for (const ir::Function& function : modules_[i].functions)
                    for (const ir::Block& block : function.blocks)
                        for (const Inst& inst : block.insts)
                            nested |= inst.op == Op::OpTraceNV || inst.op == Op::OpTraceRayKHR;
        machine_.max_depth = options_.max_recursion_depth ? options_.max_recursion_depth : nested ? 31 : 1;
        machine_.max_callable_depth = options_.max_callable_depth ? options_.max_callable_depth : 31;
    }

    void import_traversal() {
        const TraversalModule* traversal =
            find_traversal_module(accuracy_name(options_.accuracy), machine_.addresses(), options_.checked);
        // Reports always hand over to the machine: it ends the shader after an accepted first hit.
        kinds_.report_suspends = true;
        kinds_.loops_suspend = machine_.resumable = options_.resumable;
        machine_.any_hit = has(StageKind::AnyHit);
        machine_.aabbs = has(StageKind::Intersection);
        // What the stages will say is not known yet; what follows from the lists and promises is.
        std::map<uint32_t, uint32_t> choices{{RTC_LINK_RESUMABLE, options_.resumable}};
        if (!machine_.any_hit) choices[RTC_LINK_ANY_HIT] = 0;
        if (!machine_.aabbs) choices[RTC_LINK_AABBS] = 0;
        const link::Needs scene = link::scene_needs(options_);
        choices[RTC_LINK_POSITIONS] = std::any_of(modules_.begin(), modules_.end(), lower::fetches_positions);
        choices[RTC_LINK_MIXED] = scene.mixed;
        choices[RTC_LINK_NON_OPAQUE] = scene.non_opaque;
        choices[RTC_LINK_MASKS] = scene.masks;
        choices[RTC_LINK_INSTANCE_FLAGS] = scene.instance_flags;
        choices[RTC_LINK_TRANSFORMS] = scene.transforms;
        choices[RTC_LINK_LEVELS] = scene.levels;
        choices[RTC_LINK_ASSUMED] = options_.specialize ? options_.assumptions : 0;
        machine_.import_traversal(*traversal, choices);
    }

    void read(const StageInput& stage) {
        modules_.push_back(ir::read_module(stage.spirv, stage.file));
        // OpenCL's and OpenGL's, which no Vulkan has and which change what is valid; the validator lets them by.
        for (const uint32_t capability : {4, 5, 6, 7, 8, 13, 14, 15, 17, 19, 20, 21, 38, 58, 59, 60})
            if (modules_.back().has_capability(static_cast<spv::Capability>(capability)))
                ir::fail("target-capability", stage.file, 0,
                         "stage '" + stage.name + "' declares SPIR-V capability " + std::to_string(capability) +
                             ", which is not Vulkan's");
        // Before anything looks into it, and also when the result's validation is switched off: all that follows
        // relies on valid input.
        const std::string problem = options_.trust_input ? "" : link::validate_input(modules_.back());
        if (!problem.empty())
            ir::fail("spirv-invalid", stage.file, 0, "stage '" + stage.name + "' is not valid SPIR-V: " + problem);
    }

    void add_stage(uint32_t index, std::map<uint32_t, uint32_t>& spec_ids) {
        const StageInput& stage_input = input_.stages[index];
        ir::Module& module = modules_[index];
        const ir::EntryPoint* entry = nullptr;
        for (const ir::EntryPoint& candidate : module.entry_points)
            if (candidate.name == stage_input.entry && candidate.model == execution_model(stage_input.kind))
                entry = &candidate;
        if (!entry)
            ir::fail("entry-point-missing", stage_input.file, 0,
                     "no " + std::string(stage_kind_name(stage_input.kind)) + " entry point named '" +
                         stage_input.entry + "'");
        if (module.addressing == spv::AddressingModel::PhysicalStorageBuffer64)
            program_.module.addressing = module.addressing;
        if (module.memory_model == spv::MemoryModel::Vulkan) program_.module.memory_model = module.memory_model;
        program_.module.version = std::max(program_.module.version, module.version);
        const Id entry_function = entry->function;
        // Other entry points and their modes are not part of this stage.
        module.execution_modes.clear();
        link::specialize(module, stage_input, spec_ids, result_.reflection.spec_constants);

        ir::IdMap<Id> map;
        std::vector<ir::Function> functions = program_.import(module, map);

        lower::Stage stage;
        stage.kind = stage_input.kind;
        stage.index = index;
        stage.name = stage_input.name;
        stage.file = stage_input.file;
        std::set<Id> variables;
        for (const Inst& inst : module.globals)
            if (inst.op == Op::OpVariable) variables.insert(map.get(inst.result));
        lower::select_entry(program_, stage, std::move(functions), map.get(entry_function), variables);
        // NV's exits and locations first: nothing later may see code after an ignore.
        lower::normalize_calls(program_, stage);
        check::check_stage(program_, stage, input_, result_.diagnostics);
        check::collect_data_types(program_, stage, data_types_);
        // Inlining before interface lowering: pointers to payloads and acceleration structures
        // that were passed to functions become plain variables and chains.
        lower::inline_calls(program_, stage, kinds_);
        lower::lower_interface(program_, stage, machine_);
        lower::lower_records(program_, stage, machine_);
        link::unify_resources(program_, stage, resources_, result_.reflection);
        // Last before the split: earlier passes may still move values between blocks.
        lower::to_memory_form(program_, stage, kinds_);
        lower::select_elements(program_, stage);
        if (machine_.resumable) lower::count_loops(program_, stage, machine_);
        link::collect_trace_facts(program_, stage, trace_facts_, bit_tables_);

        StageReport report;
        report.kind = stage.kind;
        report.name = stage.name;
        report.file = stage.file;
        report.first_state = machine_.entry_state(index);
        report.record_bytes = stage.record_bytes;
        if (stage.incoming)
            report.payload_words = program_.word_count(program_.pointee(program_.def(stage.incoming)->type), "payload");
        if (stage.attribute) {
            uint32_t& words = result_.reflection.attribute_words;
            words = std::max(words, program_.word_count(program_.pointee(program_.def(stage.attribute)->type), "attribute"));
        }
        const size_t before = machine_.states.size();
        continuation::split_stage(program_, stage, kinds_, machine_);
        report.states = static_cast<uint32_t>(machine_.states.size() - before);
        result_.reflection.stages.push_back(std::move(report));
        for (Id id : stage.variables)
            if (static_cast<spv::StorageClass>(program_.def(id)->ops[0]) == spv::StorageClass::Private)
                machine_.stage_variables.push_back(id);
        if (stage.record_base) machine_.stage_variables.push_back(stage.record_base);
        for (ir::Function& function : stage.functions) helpers_.push_back(std::move(function));
    }

    // What the pipeline and its scenes do not need is not linked: shaders that cannot run, parts of the traversal.
    void decide_needs() {
        link::PipelineShape shape;
        shape.has_any_hit = has(StageKind::AnyHit);
        shape.has_intersection = has(StageKind::Intersection);
        shape.nested = nested_;
        shape.recursion_depth = machine_.max_depth;
        for (const StageReport& stage : result_.reflection.stages) shape.records |= stage.record_bytes != 0;
        const link::Needs needs = link::decide(trace_facts_, shape, options_, result_.reflection.facts);
        machine_.any_hit = needs.any_hit;
        machine_.aabbs = needs.aabbs;
        if (!needs.any_hit) remove_states(StageKind::AnyHit);
        if (!needs.aabbs) remove_states(StageKind::Intersection);
        const uint32_t assumed = machine_.traces && options_.specialize ? options_.assumptions : 0;
        result_.reflection.assumptions = assumed;
        machine_.checks_scene = assumed != 0;
        machine_.freeze_link_constants({{RTC_LINK_ANY_HIT, needs.any_hit},
                                        {RTC_LINK_AABBS, needs.aabbs},
                                        {RTC_LINK_TRIANGLES, needs.triangles}});
    }

    void remove_states(StageKind kind) {
        std::erase_if(machine_.states,
                      [&](const continuation::State& state) { return input_.stages[state.stage].kind == kind; });
        for (StageReport& stage : result_.reflection.stages)
            if (stage.kind == kind) stage.states = 0;
        removed_kinds_.insert(kind);
    }

    void dump_facts() {
        for (const FactReport& fact : result_.reflection.facts)
            result_.dump += fact.name + ": " + fact.state + ", " + fact.detail + "\n";
        result_.ok = true;
    }

    // Traversal and machine without what they cannot need. (Not before: states look names up.)
    void specialize_code() {
        std::map<Id, link::Bits> given;
        if (trace_facts_.sites) {
            const auto give = [&](const char* fact, const char* variable, const link::Bits& bits) {
                if (!options_.ignores(fact)) given[machine_.variable(variable)] = bits;
            };
            give("ray flags", "rtc_ray_flags", trace_facts_.flags);
            give("cull mask", "rtc_ray_mask", trace_facts_.mask);
            give("SBT record offset", "rtc_ray_sbt_offset", trace_facts_.offset);
            give("SBT record stride", "rtc_ray_sbt_stride", trace_facts_.stride);
            give("miss index", "rtc_ray_miss", trace_facts_.miss);
        }
        const std::vector<ir::Function*> left = link::fold(program_, main_, given, bit_tables_);
        link::remove_dead(program_, left, machine_.function("rtc_trace_save"), machine_.function("rtc_scratch_store"));
        report_unread();
    }

    void report_unread() {
        if (!trace_facts_.sites) return;
        static const std::pair<const char*, const char*> kHit[] = {
            {"rtc_hit_kind", "gl_HitKind"},         {"rtc_hit_primitive", "gl_PrimitiveID"},
            {"rtc_hit_geometry", "gl_GeometryIndex"}, {"rtc_hit_attr0", "hit attributes"},
        };
        ir::IdSet read;
        for (const ir::Function& function : program_.module.functions)
            for (const ir::Block& block : function.blocks)
                for (const Inst& inst : block.insts)
                    if (inst.op == Op::OpLoad) read.insert(inst.ops[0]);
        std::string unread;
        for (const auto& [variable, name] : kHit)
            if (!read.count(machine_.variable(variable))) unread += (unread.empty() ? "" : ", ") + std::string(name);
        result_.reflection.facts.push_back({"built-ins read", "proven",
                                            unread.empty() ? "all that a hit has" : "not " + unread + ": not kept"});
    }

    // The states as functions of their own, for golden tests: text before traversal is linked.
    void dump_states() {
        std::sort(machine_.states.begin(), machine_.states.end(),
                  [](const continuation::State& a, const continuation::State& b) { return a.id < b.id; });
        for (continuation::State& state : machine_.states)
            program_.module.set_name(state.blocks.front().label, "state." + std::to_string(state.id) + "." + state.name);
        ir::Module& m = program_.module;
        ir::Function main;
        main.def = Inst(Op::OpFunction, program_.void_type(), m.new_id(),
                        {0, program_.function_type(program_.void_type(), {})});
        m.set_name(main.id(), "states");
        for (continuation::State& state : machine_.states)
            for (ir::Block& block : state.blocks) main.blocks.push_back(std::move(block));
        std::set<Id> used;
        for (const ir::Block& block : main.blocks)
            for (const Inst& inst : block.insts) inst.for_each_id([&](Id id) { used.insert(id); });
        std::vector<Inst> variables;
        for (const Inst& variable : machine_.variables())
            if (used.count(variable.result)) variables.push_back(variable);
        if (!main.blocks.empty())
            main.blocks.front().insts.insert(main.blocks.front().insts.begin(), variables.begin(), variables.end());
        const Id main_id = main.id();
        for (ir::Function& function : helpers_) m.functions.push_back(std::move(function));
        m.functions.push_back(std::move(main));
        // Traversal functions are named but not shown.
        link::tidy(program_, {main_id});
        result_.dump = ir::to_text(ir::write_module(m, true));
        result_.ok = true;
    }

    void assemble() {
        ir::Function main = machine_.build_main(helpers_);
        main_ = main.id();
        ir::Module& m = program_.module;
        for (ir::Function& function : machine_.traversal_functions) m.functions.push_back(std::move(function));
        for (ir::Function& function : machine_.helper_functions) m.functions.push_back(std::move(function));
        for (ir::Function& function : helpers_) m.functions.push_back(std::move(function));
        m.functions.push_back(std::move(main));
    }

    void finish() {
        Reflection& r = result_.reflection;
        if (options_.specialize) specialize_code();
        link::place_reserved(program_, machine_, options_, r);
        link::declare_entry(program_, main_, options_, r);
        link::tidy(program_, {main_});
        main_ = program_.module.entry_points[0].function;
        link::declare_interface(program_.module);

        r.flags = (machine_.resumable ? RTC_MODULE_RESUMABLE : 0) |
                  (machine_.addresses() ? RTC_MODULE_ADDRESS_MODE : 0) | (options_.checked ? RTC_MODULE_CHECKED : 0);
        r.accuracy = options_.accuracy;
        r.state_count = static_cast<uint32_t>(machine_.states.size());
        r.max_recursion_depth = machine_.max_depth;
        r.max_callable_depth = machine_.callables ? machine_.max_callable_depth : 0;
        r.stack_words = machine_.stack_words;
        r.payload_words = machine_.payload_word_count();
        r.callable_words = machine_.callable_word_count();
        r.scratch_words = machine_.scratch_words;
        r.trace_sites = machine_.sites;
        r.required_features = link::required_features(program_.module);
        for (const Inst& inst : program_.module.globals) {
            uint32_t set = 0, binding = 0;
            if (inst.op != Op::OpVariable ||
                !program_.decoration(inst.result, spv::Decoration::DescriptorSet, &set) || set != r.reserved_set)
                continue;
            program_.decoration(inst.result, spv::Decoration::Binding, &binding);
            if (binding >= r.reserved_binding && binding < r.reserved_binding + RTC_BINDING_COUNT)
                r.used_bindings |= 1u << (binding - r.reserved_binding);
        }
        for (const ir::Function& function : program_.module.functions)
            for (const ir::Block& block : function.blocks)
                r.instruction_count += static_cast<uint32_t>(block.insts.size() + 1);

        if (options_.optimize != Optimization::None) optimize();
        std::vector<uint32_t> words = ir::write_module(program_.module, options_.debug_info);
        // FNV-1a over the code: the identity every handle of this module carries.
        uint32_t identity = 2166136261u;
        for (uint32_t word : words) identity = (identity ^ word) * 16777619u;
        r.identity = identity ? identity : 1;
        make_groups();
        embed_reflection(words, r);
        if (options_.validate) {
            const uint32_t minor = r.spirv_version >= 0x00010600u ? 3 : r.spirv_version >= 0x00010400u ? 2 : 1;
#ifdef NDEBUG
            const std::string problem =
                link::validate(ir::write_module(link::without_traversal(program_.module), false), minor);
#else
            const std::string problem = link::validate(words, minor);
#endif
            // The stages' own: inputs are validated for the youngest Vulkan, which refuses none.
            if (problem.rfind("Capability ", 0) == 0)
                ir::fail("target-capability", "", 0, "the stages declare what the pipeline's target lacks: " + problem);
            if (!problem.empty()) {
                result_.spirv = words;
                ir::fail("internal-invalid-module", "", 0,
                         "the linked module is not valid for its target; this is a bug in rtc, or a feature the "
                         "target lacks: " + problem);
            }
        }
        result_.dump = options_.stop_after.empty() ? "" : ir::to_text(words);
        result_.spirv = std::move(words);
        result_.ok = true;
    }

    // SPIRV-Tools' optimiser on everything but traversal.
    void optimize() {
        // SPIRV-Tools 2023.1 crashes where it simplifies insertions deep into composites (its issue 4953), and makes
        // them itself of deep stores.
        bool deep = false;
        for (ir::Function& function : program_.module.functions) {
            if (function.prepared) continue;
            ir::clean_up(program_, function);
            ir::split_nested_inserts(program_, function);
            deep |= ir::stores_deep(function);
        }
        std::vector<uint32_t> words =
            ir::write_module(link::without_traversal(program_.module), options_.debug_info);
        std::string message;
        if (!link::optimize(words, options_.optimize, !deep, message))
            ir::fail("optimizer", "", 0, "the optimiser failed: " + message);
        program_.module = link::with_traversal(ir::read_module(words, "the optimised module"), std::move(program_.module));
        program_.reindex();
        link::tidy(program_, {program_.module.entry_points[0].function});
        link::declare_interface(program_.module);
    }

    void make_groups() {
        for (const GroupInput& group : input_.groups) {
            GroupReport report;
            report.kind = group.kind;
            report.name = group.name;
            auto entry = [&](int stage) {
                const bool none = stage < 0 || removed_kinds_.count(input_.stages[static_cast<size_t>(stage)].kind);
                return none ? 0u : machine_.entry_state(static_cast<uint32_t>(stage));
            };
            report.handle[0] = group.kind == GroupKind::General ? entry(group.general) : entry(group.closest_hit);
            report.handle[1] = entry(group.any_hit);
            report.handle[2] = entry(group.intersection);
            report.handle[3] = static_cast<uint32_t>(group.kind) + 1;
            report.handle[7] = result_.reflection.identity;
            result_.reflection.groups.push_back(std::move(report));
        }
    }

    const PipelineInput& input_;
    const LinkOptions& options_;
    LinkResult& result_;
    Program program_;
    Machine machine_;
    lower::CallKinds kinds_;
    check::DataTypes data_types_;
    std::vector<ir::Module> modules_;
    link::ResourceTable resources_;
    link::TraceFacts trace_facts_;
    link::BitAnalysis::Tables bit_tables_;
    std::set<StageKind> removed_kinds_;
    bool nested_ = false;
    std::vector<ir::Function> helpers_;
    Id main_ = 0;
};

}  // namespace

LinkResult link_pipeline(const PipelineInput& input, const LinkOptions& options) {
    LinkResult result;
    try {
        Linker(input, options, result).run();
    } catch (const ir::CompileError& error) {
        result.ok = false;
        result.diagnostics.push_back(error.diagnostic);
    } catch (const std::exception& error) {
        result.ok = false;
        result.diagnostics.push_back(
            {Severity::Error, "internal-error", "", 0, std::string("internal error: ") + error.what()});
    }
    return result;
}

}  // namespace rtc
