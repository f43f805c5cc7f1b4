#include <cstdio>

#include "arguments.h"

namespace cli {

void print_help() {
    std::fputs(
        R"(rtc - Links ray tracing shaders into one Vulkan compute shader

Usage: rtc [options] file...

An input file of - is the standard input. Files are GLSL (GL_NV_ray_tracing or
GL_EXT_ray_tracing) or SPIR-V, told apart by SPIR-V's magic number.

Options:
  --accuracy=<tier> Speed for accuracy: fast (leaks at edges), watertight (the
                    default: no cracks), exact (the triangle that exact
                    arithmetic hits), exact64 (the same with Float64; no
                    faster on any device measured, NVIDIA refuses it).
  --addressing=<mode>
                    How acceleration structures are reached: heap (default;
                    plain Vulkan 1.1) or address (needs bufferDeviceAddress).
  --assume=<name>[,<name>...]
                    Promise about every scene traced: opaque, single-level,
                    identity-transforms, no-masks, no-instance-flags, triangles,
                    aabbs. Removes code; a scene that breaks a promise is not
                    traced and sets the launch error.
  -c                Only compile: each GLSL file to its own SPIR-V stage
                    (FILE.spv), nothing is linked.
  --checked         Traversal checks what it reads before it follows it: damaged
                    acceleration structures set the launch error. Slower.
  --compat=gdc2019  Accept spellings of "RTX on Vulkan" (GDC 2019): blocks used
                    by their block's name, missing `uniform`,
                    gl_GlobalInvocationIDNV, gl_hitTNV.
  -Dmacro[=defn]    Add an implicit macro definition.
  --dump-after=<pass>
                    Print the module after that pass and stop (for rtc's tests).
  -E                Output only the results of the preprocessing step.
                    Output defaults to standard output.
  -fentry-point=<name>
                    The entry point of the SPIR-V files that follow.
                    GLSL's is always main.
  -fshader-stage=<stage>
                    Treat subsequent input files as having stage <stage>.
                    Valid stages are rgen, rint, rahit, rchit, rmiss, rcall.
                    Else a #pragma shader_stage, a file's extension (.rgen,
                    .rgen.glsl, ...) or a SPIR-V module's execution model tells.
  -g                Keep source-level debug information (names, lines, source).
  -h, --help        Display available options.
  --hit-group <name>=<file>[,<file>...]
                    A hit group of one .rchit, .rahit and .rint each, or fewer;
                    files, or names given to --stage.
  -I <value>        Add directory to include search path.
  -M                Generate make dependencies. Implies -E and -w.
  -MM               An alias for -M.
  -MD               Generate make dependencies and compile.
  -MF <file>        Write dependency output to the given file.
  -MT <target>      Specify the target of the rule emitted by dependency
                    generation.
  --max-callable-depth=<n>
                    Callables nested in callables, up to 31. Default: from the
                    call graph; needed when that has a cycle.
  --max-recursion-depth=<n>
                    Trace calls nested in trace calls, 1 to 31. Default 1: only
                    ray generation shaders trace.
  -mfmt=<format>    Output SPIR-V binary code using the selected format. This
                    option may be specified only when the compilation output is
                    in SPIR-V binary code form. Available options are bin, c and
                    num. Default is bin.
  --no-resumable    Lanes cannot suspend: smaller and faster modules, but long
                    launches end early on drivers that limit loops.
  --no-specialize   Keep what the pipeline and --assume show not to be needed
                    (for comparison).
  --no-validate     Do not run the SPIR-V validator on the result.
  -O                Optimize the generated SPIR-V code for performance.
  -Os               Optimize the generated SPIR-V code for size.
  -O0               Disable optimizations (the default).
  -o <file>         Write output to <file>; - is the standard output. Default is
                    a.spv, a.spvasm with -S.
  --pipeline <file.json>
                    Stages and groups from a file, see below.
  --reflect <file.json>
                    Write the pipeline's reflection as JSON. Also reads it from
                    a finished module given as the only input.
  --report          Print states, frame bytes at each trace site and
                    instruction counts; what is known about rays and scenes and
                    what that removed.
  --reserved=<set>[.<binding>]
                    Put rtc's own descriptors into this set, from that binding
                    on. Default: the highest set used + 1, from binding 0.
  --scene-profile <file.json>
                    Assume what rtrWriteSceneProfile found true of a scene.
  -S                Emit SPIR-V assembly instead of binary.
  --stage=<name>=<kind>:<file>[:<entry>][,spec.<id>=<value>...]
                    A stage by name: its kind (rgen ... rcall), file, entry
                    point and specialisation constants.
  -std=<value>      Version and profile for GLSL input files. Possible values
                    are concatenations of version and profile, e.g. 460core.
  --target-env=<environment>
                    What the module may use: vulkan1.1, vulkan1.2, vulkan1.3.
                    Default: vulkan1.1 for NV shaders, vulkan1.2 for EXT.
                    Independent of the version the sources are parsed for.
  -U<macro>         Undefine macro.
  --version         Display compiler version information.
  -w                Suppresses all warning messages.
  -Werror           Treat all warnings as errors.
  -x <language>     Treat subsequent input files as having type <language>
                    (glsl, spirv). Files tell themselves; accepted for glslc's
                    users.
  @<file>           Read options from <file>.

Groups are numbered in command line order: each .rgen, .rmiss and .rcall file or
stage is a general group, each --hit-group a hit group, each .rchit that no
--hit-group names a hit group of its own.

A pipeline file:
  { "stages": [ {"name": "camera", "file": "a.spv", "kind": "rgen",
                 "entry": "main", "spec": {"0": 4, "1": 0.5}} ],
    "groups": [ {"name": "camera", "general": "camera"},
                {"name": "glass", "closestHit": "c", "anyHit": "a"} ] }
"kind", "entry", "spec" and "groups" may be left out. Beside "stages":
"assume": ["opaque", ...], "sceneProfile": "file.json" and
"accuracy": "exact", which yields to --accuracy.

Exit status: 0 success, 1 errors in the inputs or on the command line (as glslc).
)",
        stdout);
}

void print_version() {
    std::printf("rtc %s\nABI version %u\n%s\n", rtcc_version(), rtcc_abi_version(), rtcc_front_end_version());
}

}  // namespace cli
