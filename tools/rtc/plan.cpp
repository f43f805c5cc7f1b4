#include "plan.h"

#include "error.h"

namespace cli {
namespace {

std::vector<std::string> split_list(const std::string& text) {
    std::vector<std::string> items;
    for (size_t begin = 0; begin <= text.size();) {
        size_t end = text.find(',', begin);
        if (end == std::string::npos) end = text.size();
        if (end > begin) items.push_back(text.substr(begin, end - begin));
        begin = end + 1;
    }
    return items;
}

class Planner {
  public:
    Planner(const Arguments& arguments, SourceFiles& files) : arguments_(arguments), files_(files) {}

    // Stages first, so that a hit group may name what comes after it; groups then, in order.
    Plan run() {
        for (const InputArgument& input : arguments_.inputs) {
            stage_of_input_.push_back(-1);
            if (input.kind == InputArgument::Kind::File) stage_of_input_.back() = file_stage(input);
            if (input.kind == InputArgument::Kind::Stage) stage_of_input_.back() = named_stage(input);
        }
        std::vector<PlannedGroup> hit_groups;
        for (const InputArgument& input : arguments_.inputs)
            if (input.kind == InputArgument::Kind::HitGroup) hit_groups.push_back(hit_group(input));

        size_t next_hit_group = 0;
        for (size_t i = 0; i < arguments_.inputs.size(); ++i) {
            const InputArgument& input = arguments_.inputs[i];
            if (input.kind == InputArgument::Kind::Pipeline) {
                add_pipeline_file(input.file, files_, plan_);
            } else if (input.kind == InputArgument::Kind::HitGroup) {
                plan_.add_group(std::move(hit_groups[next_hit_group++]), "rtc: error: ");
            } else if (arguments_.mode == Mode::Link &&
                       !plan_.stages[static_cast<size_t>(stage_of_input_[i])].grouped) {
                plan_.add_own_group(stage_of_input_[i], "rtc: error: ");
            }
        }
        return std::move(plan_);
    }

  private:
    int file_stage(const InputArgument& input) {
        PlannedStage stage;
        stage.source = files_.open(input.file);
        // Names are short unless that would make them clash.
        stage.name = last_component(stage.source->name);
        if (plan_.find_stage(stage.name) >= 0) stage.name = stage.source->name;
        if (stage.source->is_spirv) stage.entry = input.entry;
        stage.kind = stage_kind_of(*stage.source, input.stage, stage.entry);
        return plan_.add_stage(std::move(stage), "rtc: error: ");
    }

    int named_stage(const InputArgument& input) {
        PlannedStage stage;
        stage.name = input.name;
        stage.source = files_.open(input.file);
        stage.kind = input.stage;
        stage.entry = input.entry;
        stage.specialization = input.specialization;
        return plan_.add_stage(std::move(stage), "rtc: error: ");
    }

    int member(const std::string& text) {
        const int named = plan_.find_stage(text);
        if (named >= 0) return named;
        for (size_t i = 0; i < plan_.stages.size(); ++i)
            if (plan_.stages[i].source->name == text && plan_.stages[i].specialization.empty())
                return static_cast<int>(i);
        InputArgument input;
        input.file = text;
        return file_stage(input);
    }

    PlannedGroup hit_group(const InputArgument& input) {
        PlannedGroup group;
        group.name = input.name;
        group.general = false;
        for (const std::string& text : split_list(input.file)) {
            const int index = member(text);
            PlannedStage& stage = plan_.stages[static_cast<size_t>(index)];
            stage.grouped = true;
            size_t slot = 0;
            switch (stage.kind) {
                case RTCC_STAGE_CLOSEST_HIT:
                case RTCC_STAGE_AUTO:
                    slot = 0;
                    break;
                case RTCC_STAGE_ANY_HIT:
                    slot = 1;
                    break;
                case RTCC_STAGE_INTERSECTION:
                    slot = 2;
                    break;
                default:
                    throw UsageError("hit group '" + input.name + "': '" + text + "' is of kind " +
                                     rtcc_stage_name(stage.kind) + ", expected rchit, rahit or rint");
            }
            if (group.stages[slot] >= 0)
                throw UsageError("hit group '" + input.name + "' has more than one " +
                                 rtcc_stage_name(stage.kind));
            group.stages[slot] = index;
        }
        return group;
    }

    const Arguments& arguments_;
    SourceFiles& files_;
    Plan plan_;
    std::vector<int> stage_of_input_;
};

}  // namespace

int Plan::find_stage(const std::string& name) const {
    for (size_t i = 0; i < stages.size(); ++i)
        if (stages[i].name == name) return static_cast<int>(i);
    return -1;
}

int Plan::add_stage(PlannedStage stage, const std::string& where) {
    if (find_stage(stage.name) >= 0) throw InputError(where + "two stages are named '" + stage.name + "'");
    stages.push_back(std::move(stage));
    return static_cast<int>(stages.size() - 1);
}

void Plan::add_group(PlannedGroup group, const std::string& where) {
    for (const PlannedGroup& other : groups)
        if (other.name == group.name) throw InputError(where + "two groups are named '" + group.name + "'");
    for (int32_t stage : group.stages)
        if (stage >= 0) stages[static_cast<size_t>(stage)].grouped = true;
    groups.push_back(std::move(group));
}

void Plan::add_own_group(int index, const std::string& where) {
    const PlannedStage& stage = stages[static_cast<size_t>(index)];
    if (stage.kind == RTCC_STAGE_ANY_HIT || stage.kind == RTCC_STAGE_INTERSECTION)
        throw InputError(where + "'" + stage.name + "' (" + rtcc_stage_name(stage.kind) +
                         ") is in no hit group; use --hit-group NAME=FILE[,FILE...]");
    PlannedGroup group;
    group.name = stage.name;
    group.general = stage.kind != RTCC_STAGE_CLOSEST_HIT;
    group.stages[0] = index;
    add_group(std::move(group), where);
}

rtcc_stage stage_kind_of(const SourceFile& source, rtcc_stage wanted,
                         const std::optional<std::string>& entry) {
    if (wanted != RTCC_STAGE_AUTO) return wanted;
    if (source.is_spirv)
        return rtcc_module_stage(source.words.data(), source.words.size(), entry ? entry->c_str() : nullptr);
    return rtcc_stage_from_source(source.name.c_str(), source.bytes.data(), source.bytes.size());
}

Plan make_plan(const Arguments& arguments, SourceFiles& files) { return Planner(arguments, files).run(); }

}  // namespace cli
