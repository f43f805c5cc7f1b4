// A pipeline with everything it needs to run: what a command line or a case file says.
#pragma once

#include <map>
#include <set>
#include <string>
#include <vector>

#include "../native/executor.h"
#include "../native/glsl.h"
#include "module_reader.h"
#include "values.h"

namespace rtc::run {

enum class Dialect { AsWritten, Ext };  // Ext: NV sources are rewritten first

struct Slot {  // (set, binding)
    uint32_t set = 0, binding = 0;
    auto operator<=>(const Slot&) const = default;
};
Slot parse_slot(const std::string& text);  // "0.1"
std::string slot_name(Slot slot);

struct StageSource {
    std::string name;
    tools::JobStage stage = tools::JobStage::RayGen;
    std::string file;             // for messages; read when `text` and `words` are empty
    std::string text;             // GLSL
    std::vector<uint32_t> words;  // SPIR-V
    std::string entry;            // SPIR-V: empty takes the first
    std::vector<std::string> defines;
    std::map<std::string, Json> constants;  // by id or by name
};

struct Expectation {
    std::string cell;  // what it shows
    Slot slot;
    std::string type;  // "u32", "i32", "f32", "u64", "f64"
    size_t at = 0;     // index of the first value, in units of the type
    Json values;       // a list; null: taken from the native run
    double absolute = 0, relative = 0;
    std::string native;  // why native drivers are known to differ; "" if they must not
};

struct Job {
    std::string name, file, section;
    std::vector<StageSource> sources;
    std::vector<std::string> include_dirs;
    Json groups, table, bindings = Json::object(), push, constants = Json::object();
    native::World world;
    bool has_scene = false;
    uint32_t width = 1, height = 1, depth = 1;
    bool sized = false;
    uint32_t recursion = 0, callable_depth = 0;  // 0: from the shaders
    std::vector<Expectation> expectations;
    std::string launch_error;                 // expected on rtc, "" for none
    std::string addressing;                   // "heap" or "address" where rtc must link for that one, else ""
    std::string assume;                       // promises about the scene, as rtc --assume takes them
    std::set<std::string> only;               // dialects or backends a case is limited to; empty: all
    std::map<std::string, std::string> skip;  // backend -> reason

    // Filled by compile().
    tools::JobPipeline pipeline;
    std::vector<Module> modules;
};

// Throws tools::Error naming the place.
Job parse_case(const Json& json, const std::string& file);
Job load_case(const std::string& file);
StageSource stage_from_file(const std::string& path);

// Scenes: the JSON of docs/rtc-run.md, or any file rtc-render loads.
native::World parse_scene(const Json& json, const std::string& folder);
native::World load_scene(const std::string& path);
native::World default_scene();  // one triangle and one box, in front of a ray along +z

// Sources to SPIR-V in a dialect, groups and modules resolved. May be called again for another dialect.
void compile(Job& job, Dialect dialect, bool debug_info = false);
// Records with their data; group names are resolved; made when the case gives none.
native::Tables make_tables(const Job& job, const AddressOf& address);

}  // namespace rtc::run
