// The pipeline the command line describes: stages and groups, in order.
//
// Groups come in command line order: each rgen, rmiss and rcall is a general group,
// each --hit-group a hit group, and an rchit that no hit group names is a hit group
// of its own. A --pipeline FILE brings its groups at its place.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "arguments.h"
#include "inputs.h"

namespace cli {

struct PlannedStage {
    std::string name;
    std::shared_ptr<const SourceFile> source;
    rtcc_stage kind = RTCC_STAGE_AUTO;  // AUTO: cannot be told; compiling it says why
    std::optional<std::string> entry;
    std::vector<SpecArgument> specialization;
    bool grouped = false;
};

struct PlannedGroup {
    std::string name;
    bool general = true;
    int32_t stages[3] = {-1, -1, -1};  // general; or closest hit, any hit, intersection
};

struct Plan {
    std::vector<PlannedStage> stages;
    std::vector<PlannedGroup> groups;
    std::vector<std::string> description_files;  // the --pipeline files
    std::vector<std::string> assume, scene_profiles;  // of pipeline files
    std::optional<rtcc_accuracy> accuracy;       // what they ask for

    int find_stage(const std::string& name) const;
    // Throws InputError `where` + text when the name is taken.
    int add_stage(PlannedStage stage, const std::string& where);
    void add_group(PlannedGroup group, const std::string& where);
    // The group a stage makes by itself; none for an any-hit or intersection stage.
    void add_own_group(int stage, const std::string& where);
};

// Throws UsageError or InputError.
Plan make_plan(const Arguments& arguments, SourceFiles& files);

// Adds what a --pipeline file says: {"stages": […], "groups": […]}, see pipeline_file.cpp.
void add_pipeline_file(const std::string& path, SourceFiles& files, Plan& plan);

rtcc_stage stage_kind_of(const SourceFile& source, rtcc_stage wanted,
                         const std::optional<std::string>& entry);

}  // namespace cli
