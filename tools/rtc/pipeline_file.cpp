// --pipeline FILE.json:
//
//   { "stages": [ {"name": "camera", "kind": "rgen", "file": "a.spv", "entry": "main",
//                  "spec": {"0": 4, "1": 0.5, "2": true}}, … ],
//     "groups": [ {"name": "camera", "general": "camera"},
//                 {"name": "glass", "closestHit": "c", "anyHit": "a", "intersection": "i"} ],
//     "assume": ["opaque", …], "sceneProfile": "scene.json", "accuracy": "exact" }
//
// "name" defaults to the file's last component, "kind" to what the file says, "groups"
// to what the command line would make of the stages. Files are relative to the JSON file.
#include <charconv>
#include <filesystem>

#include "error.h"
#include "json.h"
#include "plan.h"

namespace cli {
namespace {

using Kind = JsonValue::Kind;

class Reader {
  public:
    Reader(const std::string& path, SourceFiles& files, Plan& plan)
        : path_(path), files_(files), plan_(plan) {}

    void run() {
        const std::string name = path_ == "-" ? "<stdin>" : path_;
        const JsonValue root = parse_json(read_input(path_), path_ = name);
        check(root, Kind::Object);
        const JsonValue* stages = nullptr;
        const JsonValue* groups = nullptr;
        for (const JsonValue::Member& member : root.members) {
            if (member.name == "stages")
                stages = &check(member.value, Kind::Array);
            else if (member.name == "groups")
                groups = &check(member.value, Kind::Array);
            else if (member.name == "assume")
                assume(check(member.value, Kind::Array));
            else if (member.name == "sceneProfile")
                plan_.scene_profiles.push_back(resolved(string(member.value)));
            else if (member.name == "accuracy")
                accuracy(member.value);
            else
                unknown(member);
        }
        if (!stages) json_error(path_, root.place, "\"stages\" is missing");
        for (const JsonValue& item : stages->items) stage(item);
        if (groups)
            for (const JsonValue& item : groups->items) group(item);
        else
            for (const auto& [index, place] : added_) plan_.add_own_group(index, at(place));
        if (groups)
            for (const auto& [index, place] : added_)
                if (!plan_.stages[static_cast<size_t>(index)].grouped)
                    json_error(
                        path_, place,
                        "stage \"" + plan_.stages[static_cast<size_t>(index)].name + "\" is in no group");
        if (name != "<stdin>") plan_.description_files.push_back(name);
    }

  private:
    std::string at(JsonPlace place) const {
        return path_ + ":" + std::to_string(place.line) + ":" + std::to_string(place.column) + ": error: ";
    }

    const JsonValue& check(const JsonValue& value, Kind kind) const {
        if (value.kind != kind)
            json_error(
                path_, value.place,
                std::string("expected ") + json_kind_name(kind) + ", found " + json_kind_name(value.kind));
        return value;
    }

    const std::string& string(const JsonValue& value) const {
        check(value, Kind::String);
        if (value.text.empty()) json_error(path_, value.place, "expected a string that is not empty");
        return value.text;
    }

    [[noreturn]] void unknown(const JsonValue::Member& member) const {
        json_error(path_, member.place, "unknown member \"" + member.name + "\"");
    }

    std::string resolved(const std::string& file) const {
        const size_t slash = path_.find_last_of("/\\");
        if (file == "-" || slash == std::string::npos || std::filesystem::path(file).is_absolute())
            return file;
        return path_.substr(0, slash + 1) + file;
    }

    void assume(const JsonValue& value) {
        for (const JsonValue& item : value.items) {
            const std::string& name = string(item);
            bool known = false;
            for (size_t i = 0; rtcc_assumption_name(i); ++i) known |= name == rtcc_assumption_name(i);
            if (!known) json_error(path_, item.place, "no assumption is named \"" + name + "\"");
            plan_.assume.push_back(name);
        }
    }

    void accuracy(const JsonValue& value) {
        plan_.accuracy = parse_accuracy(string(value));
        if (!plan_.accuracy)
            json_error(path_, value.place,
                       "\"" + value.text + "\" is no accuracy: expected fast, watertight, exact or exact64");
    }

    void stage(const JsonValue& value) {
        check(value, Kind::Object);
        PlannedStage stage;
        rtcc_stage kind = RTCC_STAGE_AUTO;
        JsonPlace name_place = value.place;
        for (const JsonValue::Member& member : value.members) {
            if (member.name == "name") {
                stage.name = string(member.value);
                name_place = member.value.place;
            } else if (member.name == "kind") {
                kind = rtcc_stage_from_name(string(member.value).c_str());
                if (kind == RTCC_STAGE_AUTO)
                    json_error(path_, member.value.place,
                               "\"" + member.value.text +
                                   "\" is no stage: expected rgen, rint, rahit, rchit, rmiss "
                                   "or rcall");
            } else if (member.name == "file") {
                try {
                    stage.source = files_.open(resolved(string(member.value)));
                } catch (const InputError& error) {
                    // Damaged files speak for themselves; a file that is not there is this line's mistake.
                    const std::string text = error.what();
                    const std::string prefix = "rtc: error: ";
                    if (text.compare(0, prefix.size(), prefix) != 0) throw;
                    json_error(path_, member.value.place, text.substr(prefix.size()));
                }
            } else if (member.name == "entry") {
                stage.entry = string(member.value);
            } else if (member.name == "spec") {
                specialization(check(member.value, Kind::Object), stage);
            } else {
                unknown(member);
            }
        }
        if (!stage.source) json_error(path_, value.place, "\"file\" is missing");
        if (stage.name.empty()) stage.name = last_component(stage.source->name);
        stage.kind = stage_kind_of(*stage.source, kind, stage.entry);
        added_.emplace_back(plan_.add_stage(std::move(stage), at(name_place)), name_place);
    }

    void specialization(const JsonValue& value, PlannedStage& stage) const {
        for (const JsonValue::Member& member : value.members) {
            SpecArgument spec;
            const char* const begin = member.name.data();
            const char* const end = begin + member.name.size();
            const auto parsed = std::from_chars(begin, end, spec.id);
            if (member.name.empty() || parsed.ec != std::errc() || parsed.ptr != end)
                json_error(path_, member.place, "\"" + member.name + "\" is no specialisation constant's id");
            if (member.value.kind != Kind::Number && member.value.kind != Kind::Bool &&
                member.value.kind != Kind::String)
                json_error(path_, member.value.place,
                           std::string("expected a number, a bool or a string, found ") +
                               json_kind_name(member.value.kind));
            spec.value = member.value.text;
            stage.specialization.push_back(std::move(spec));
        }
    }

    int32_t member_stage(const JsonValue& value) const {
        if (value.kind == Kind::Null) return -1;
        const int found = plan_.find_stage(string(value));
        if (found < 0) json_error(path_, value.place, "no stage is named \"" + value.text + "\"");
        return found;
    }

    void group(const JsonValue& value) {
        check(value, Kind::Object);
        PlannedGroup group;
        JsonPlace name_place = value.place;
        bool has_general = false, has_hit = false;
        for (const JsonValue::Member& member : value.members) {
            if (member.name == "name") {
                group.name = string(member.value);
                name_place = member.value.place;
                continue;
            }
            const int slot = member.name == "general" || member.name == "closestHit" ? 0
                             : member.name == "anyHit"                               ? 1
                             : member.name == "intersection"                         ? 2
                                                                                     : -1;
            if (slot < 0) unknown(member);
            (member.name == "general" ? has_general : has_hit) = true;
            if (has_general && has_hit)
                json_error(path_, member.place, "a group is general or a hit group, not both");
            const int32_t stage = member_stage(member.value);
            if (stage < 0 && has_general)
                json_error(path_, member.value.place, "a general group needs a stage");
            group.stages[slot] = stage;
        }
        group.general = has_general;
        for (int32_t stage : group.stages)
            if (group.name.empty() && stage >= 0) group.name = plan_.stages[static_cast<size_t>(stage)].name;
        if (group.name.empty()) json_error(path_, value.place, "\"name\" is missing");
        plan_.add_group(std::move(group), at(name_place));
    }

    std::string path_;
    SourceFiles& files_;
    Plan& plan_;
    std::vector<std::pair<int, JsonPlace>> added_;
};

}  // namespace

void add_pipeline_file(const std::string& path, SourceFiles& files, Plan& plan) {
    Reader(path, files, plan).run();
}

}  // namespace cli
