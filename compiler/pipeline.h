// What goes into the compiler's core and what comes out: stages as SPIR-V,
// groups, options; one compute module with its reflection. The front end, the
// C library and the command line sit on top of this file; the passes below it.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace rtc {

enum class StageKind : uint32_t { RayGen, Intersection, AnyHit, ClosestHit, Miss, Callable };

const char* stage_kind_name(StageKind kind);  // "rgen", "rint", "rahit", "rchit", "rmiss", "rcall"

enum class Severity : uint32_t { Warning, Error };

// One message. `file` and `line` name user source (OpLine when the module has
// it, else the SPIR-V file with line 0); line 0 means "no line known".
struct Diagnostic {
    Severity severity = Severity::Error;
    std::string id;  // stable kebab-case name, e.g. "trace-location-unknown"
    std::string file;
    uint32_t line = 0;
    std::string text;
};

struct SpecValue {
    uint32_t id = 0;     // SpecId in the stage's module
    uint64_t value = 0;  // bit pattern of the constant
};

// A stage instance: one entry point of one module, with its specialisation.
struct StageInput {
    StageKind kind = StageKind::RayGen;
    std::string name;  // unique in the pipeline; used in reports and reflection
    std::string file;  // for diagnostics
    std::vector<uint32_t> spirv;
    std::string entry = "main";
    std::vector<SpecValue> specialization;
};

enum class GroupKind : uint32_t { General, Triangles, Procedural };  // RTC_GROUP_*

// Stage indices into PipelineInput::stages; -1 for none. A general group has
// only `general`; a hit group any of the other three, also none (null group).
struct GroupInput {
    GroupKind kind = GroupKind::General;
    std::string name;
    int general = -1;
    int closest_hit = -1;
    int any_hit = -1;
    int intersection = -1;
};

struct PipelineInput {
    std::vector<StageInput> stages;
    std::vector<GroupInput> groups;
};

enum class TargetEnv : uint32_t { Auto, Vulkan11, Vulkan12, Vulkan13 };
enum class Optimization : uint32_t { None, Performance, Size };
// How exact traversal is, see docs/accuracy.md. ExactFloat64 is Exact with the Float64 capability.
enum class Accuracy : uint32_t { Watertight, Fast, Exact, ExactFloat64 };

const char* accuracy_name(Accuracy accuracy);  // "watertight", "fast", "exact", "exact64"

// How acceleration structure memory is reached (abi.h).
enum class Addressing {
    Heap,    // offsets into one bound heap; plain Vulkan 1.1
    Address  // device addresses: needs bufferDeviceAddress
};

struct LinkOptions {
    TargetEnv target = TargetEnv::Auto;
    Optimization optimize = Optimization::None;
    Accuracy accuracy = Accuracy::Watertight;
    bool debug_info = false;            // -g: keep OpLine, OpName, OpSource
    bool validate = true;               // run spirv-val on the result (traversal apart, see link/partial.cpp)
    bool trust_input = false;           // for measurements: the stages are valid, do not run spirv-val on them
    Addressing addressing = Addressing::Heap;
    bool checked = false;               // traversal follows nothing in memory that it has not checked
    bool resumable = true;              // lanes can suspend (see docs/resumable.md)
    uint32_t max_recursion_depth = 0;   // trace calls nested in trace calls, 1..31; 0: 1, or 31 when hit or miss shaders trace
    uint32_t max_callable_depth = 0;    // 1..31; 0: 31
    int32_t reserved_set = -1;          // -1: highest used + 1
    uint32_t reserved_binding = 0;
    bool specialize = true;             // remove what the pipeline and `assumptions` show not to be needed
    uint32_t assumptions = 0;           // what scenes are promised to be: bits of Assumption
    std::vector<std::string> ignored_facts;  // for measurements: names of FactReport that count as unknown
    bool ignores(std::string_view fact) const;
    std::string stop_after;             // for tests: name of the pass after which to print and stop
};

// A promise about every scene that is traced. Each is checked when rays begin: a scene that breaks one is not
// traced (RTC_LAUNCH_ERROR_ASSUMPTION).
struct Assumption {
    const char* name;  // "opaque", "single-level", ...
    uint32_t bit;      // RTC_FACT_* of the acceleration structure's header
};
std::span<const Assumption> assumptions();
bool assumption_from_name(std::string_view name, uint32_t& bit);
std::vector<std::string> assumption_names(uint32_t bits);

// One fact about the pipeline or its scenes: what is known, why, and what it removed.
struct FactReport {
    std::string name;
    std::string state;  // "proven", "assumed", "unknown"
    std::string detail;
};

struct TraceSiteReport {
    std::string stage;
    std::string file;
    uint32_t line = 0;
    bool callable = false;
    uint32_t frame_bytes = 0;            // live state saved across the call
    std::vector<std::string> variables;  // source names of what is saved
};

struct ResourceReport {
    std::string name;
    std::string stage;
    uint32_t set = 0, binding = 0;
    // "storage-buffer", "uniform-buffer", "storage-image", "sampled-image", "sampler",
    // "combined-image-sampler", "uniform-texel-buffer", "storage-texel-buffer",
    // "input-attachment", "acceleration-structure"
    std::string type;
    uint32_t array_size = 1;  // 0: runtime array
};

struct SpecConstantReport {
    std::string stage;
    std::string name;
    uint32_t original_id = 0;
    uint32_t id = 0;  // in the linked module
    std::string type; // "bool", "int32", "uint32", "float32", ...
    uint64_t default_value = 0;
};

struct GroupReport {
    GroupKind kind = GroupKind::General;
    std::string name;
    uint32_t handle[8] = {};
};

struct StageReport {
    StageKind kind = StageKind::RayGen;
    std::string name;
    std::string file;
    uint32_t first_state = 0;
    uint32_t states = 0;
    uint32_t payload_words = 0;  // of its incoming payload or callable data
    uint32_t record_bytes = 0;   // of its shader record block; 0: none
};

struct Reflection {
    std::vector<StageReport> stages;
    std::vector<GroupReport> groups;
    std::vector<ResourceReport> resources;
    std::vector<SpecConstantReport> spec_constants;
    std::vector<TraceSiteReport> trace_sites;
    std::vector<FactReport> facts;
    uint32_t assumptions = 0;  // bits of Assumption that the module was linked with
    std::vector<std::string> required_features;  // Vulkan feature names the module needs, e.g. "shaderFloat64"
    uint32_t flags = 0;  // RTC_MODULE_*
    Accuracy accuracy = Accuracy::Watertight;
    uint32_t identity = 0;
    uint32_t reserved_set = 0, reserved_binding = 0, used_bindings = 0;
    uint32_t push_constant_bytes = 0;
    uint32_t state_count = 0;
    uint32_t max_recursion_depth = 1, max_callable_depth = 0;
    uint32_t stack_words = 0, scratch_words = 0;
    uint32_t payload_words = 0, attribute_words = 0, callable_words = 0;
    uint32_t spirv_version = 0;
    uint32_t instruction_count = 0;  // in the finished module
};

struct LinkResult {
    bool ok = false;
    std::vector<uint32_t> spirv;
    Reflection reflection;
    std::vector<Diagnostic> diagnostics;
    std::string dump;  // module text when LinkOptions::stop_after was given
};

// The whole journey below the front end. Thread-safe; what is kept between calls is a cache of prepared traversals.
LinkResult link_pipeline(const PipelineInput& input, const LinkOptions& options);

// ---- reflect/ -----------------------------------------------------------------
// Reflection as JSON text (stable key order) and back out of a finished module.
std::string reflection_to_json(const Reflection& reflection);
// Adds the OpString chunks of abi.h to a finished module.
void embed_reflection(std::vector<uint32_t>& spirv, const Reflection& reflection);
// Returns false when the module carries none or it is damaged.
bool extract_reflection_json(const std::vector<uint32_t>& spirv, std::string& json);

}  // namespace rtc
