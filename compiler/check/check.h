// Rules of ray tracing modules that spirv-val does not know, and warnings for
// what compiles but cannot work.
#pragma once

#include "lower/stage.h"

namespace rtc::check {

// After normalize_calls. Throws on errors, appends warnings.
void check_stage(const ir::Program& program, const lower::Stage& stage, const PipelineInput& input,
                 std::vector<Diagnostic>& warnings);

// Payload and callable data types that meet nowhere; after all stages are in.
struct DataTypes {
    std::vector<std::pair<std::string, ir::Id>> outgoing, incoming;  // stage name, pointee type
    std::vector<std::pair<std::string, ir::Id>> callable_outgoing, callable_incoming;
};
void collect_data_types(const ir::Program& program, const lower::Stage& stage, DataTypes& types);
void check_data_types(const ir::Program& program, const DataTypes& types, std::vector<Diagnostic>& warnings);

}  // namespace rtc::check
