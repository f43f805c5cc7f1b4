/* rtc's compiler as a C library: ray tracing stages in, one compute module out.
 *
 * The shape is shaderc's: a compiler, options that can be cloned, and a result
 * that owns everything it hands out. Between them stands a pipeline, because ray
 * tracing stages are linked together, not compiled one by one:
 *
 *     rtcc_compiler_t compiler = rtcc_compiler_create();
 *     rtcc_options_t options = rtcc_options_create();
 *     rtcc_pipeline_t pipeline = rtcc_pipeline_create();
 *     int32_t rgen = rtcc_pipeline_add_glsl(pipeline, RTCC_STAGE_RAYGEN, "main pass", "a.rgen", text, size);
 *     int32_t miss = rtcc_pipeline_add_spirv(pipeline, RTCC_STAGE_AUTO, "sky", "b.spv", words, count, NULL);
 *     rtcc_pipeline_add_general_group(pipeline, "main pass", rgen);
 *     rtcc_pipeline_add_general_group(pipeline, "sky", miss);
 *     rtcc_result_t result = rtcc_compile_pipeline(compiler, pipeline, options);
 *     if (rtcc_result_status(result) == RTCC_STATUS_SUCCESS)
 *         use(rtcc_result_words(result), rtcc_result_word_count(result));
 *     else
 *         fputs(rtcc_result_messages(result), stderr);
 *
 * Threads. There is no global state. Functions may run at the same time on
 * different objects. On one object, functions that take it as const (compiling
 * takes compiler, pipeline and options as const) may run at the same time as each
 * other, but not beside one that changes or releases it.
 *
 * Memory. Every create/clone/compile has one release, which accepts NULL. Pointers
 * that a result hands out live as long as the result. Strings are UTF-8 and end in
 * '\0'. Source text given with a size may hold anything but needs no end mark.
 *
 * Failure. Creating functions return NULL only when memory is out. Setters return
 * a status; RTCC_STATUS_INVALID_ARGUMENT leaves the object as it was. Compiling
 * functions return NULL only when memory is out, else a result whose status and
 * diagnostics tell. No exception crosses this boundary.
 *
 * The same input, options and build of rtc give the same bytes in any thread, on
 * any machine, under any path.
 */
#ifndef RTC_COMPILER_H_
#define RTC_COMPILER_H_

#include <stddef.h>
#include <stdint.h>

#include "rtc/abi.h"

#if defined(RTCC_STATIC)
#define RTCC_EXPORT
#elif defined(_WIN32)
#if defined(RTCC_BUILDING)
#define RTCC_EXPORT __declspec(dllexport)
#else
#define RTCC_EXPORT __declspec(dllimport)
#endif
#elif defined(__GNUC__)
#define RTCC_EXPORT __attribute__((visibility("default")))
#else
#define RTCC_EXPORT
#endif

#ifdef __cplusplus
extern "C" {
#endif

/* ---- Enumerations ------------------------------------------------------------
 * The *_MAX_ENUM values only make every int a value of its type: one outside the list
 * is answered with RTCC_STATUS_INVALID_ARGUMENT. */

typedef enum rtcc_status {
    RTCC_STATUS_SUCCESS = 0,
    RTCC_STATUS_INVALID_ARGUMENT = 1, /* a NULL, an index or a value outside its range */
    RTCC_STATUS_INVALID_STAGE = 2,    /* the stage of a source cannot be told, or is no ray tracing stage */
    RTCC_STATUS_COMPILATION_ERROR = 3, /* GLSL does not compile */
    RTCC_STATUS_INVALID_SPIRV = 4,    /* a SPIR-V input is malformed or lacks its entry point */
    RTCC_STATUS_LINK_ERROR = 5,       /* the stages do not make a pipeline */
    RTCC_STATUS_NO_REFLECTION = 6,    /* a module carries no (readable) reflection */
    RTCC_STATUS_OUT_OF_MEMORY = 7,
    RTCC_STATUS_INTERNAL_ERROR = 8    /* a bug of rtc: please report it */
} rtcc_status;

typedef enum rtcc_stage {
    RTCC_STAGE_RAYGEN = 0,
    RTCC_STAGE_INTERSECTION = 1,
    RTCC_STAGE_ANY_HIT = 2,
    RTCC_STAGE_CLOSEST_HIT = 3,
    RTCC_STAGE_MISS = 4,
    RTCC_STAGE_CALLABLE = 5,
    /* GLSL: #pragma shader_stage, else the file name's extension (.rgen .rint .rahit .rchit .rmiss
     * .rcall, also with .glsl behind). SPIR-V: the execution model of the entry point. */
    RTCC_STAGE_AUTO = 0x7fffffff
} rtcc_stage;

typedef enum rtcc_group_kind {
    RTCC_GROUP_KIND_GENERAL = 0,
    RTCC_GROUP_KIND_TRIANGLES = 1,
    RTCC_GROUP_KIND_PROCEDURAL = 2,
    RTCC_GROUP_KIND_MAX_ENUM = 0x7fffffff
} rtcc_group_kind;

typedef enum rtcc_severity { RTCC_SEVERITY_WARNING = 0, RTCC_SEVERITY_ERROR = 1 } rtcc_severity;

typedef enum rtcc_target_env {
    RTCC_TARGET_AUTO = 0, /* vulkan1.1, or 1.2 when a stage needs it */
    RTCC_TARGET_VULKAN_1_1 = 1,
    RTCC_TARGET_VULKAN_1_2 = 2,
    RTCC_TARGET_VULKAN_1_3 = 3,
    RTCC_TARGET_MAX_ENUM = 0x7fffffff
} rtcc_target_env;

typedef enum rtcc_addressing {
    RTCC_ADDRESSING_HEAP = 0,
    RTCC_ADDRESSING_ADDRESS = 1,
    RTCC_ADDRESSING_MAX_ENUM = 0x7fffffff
} rtcc_addressing;

typedef enum rtcc_compat {
    RTCC_COMPAT_NONE = 0,
    RTCC_COMPAT_GDC2019 = 1, /* spellings of the talk "RTX on Vulkan" (GDC 2019) that have one meaning today */
    RTCC_COMPAT_MAX_ENUM = 0x7fffffff
} rtcc_compat;

typedef enum rtcc_accuracy {
    RTCC_ACCURACY_WATERTIGHT = 0,    /* no cracks, no double hits on shared edges */
    RTCC_ACCURACY_FAST = 1,          /* cheapest tests; rays leak at edges and vertices */
    RTCC_ACCURACY_EXACT = 2,         /* what exact arithmetic hits, in its order */
    RTCC_ACCURACY_EXACT_FLOAT64 = 3, /* the same; the module needs shaderFloat64 */
    RTCC_ACCURACY_MAX_ENUM = 0x7fffffff
} rtcc_accuracy;

typedef enum rtcc_optimization {
    RTCC_OPTIMIZATION_NONE = 0,
    RTCC_OPTIMIZATION_PERFORMANCE = 1,
    RTCC_OPTIMIZATION_SIZE = 2,
    RTCC_OPTIMIZATION_MAX_ENUM = 0x7fffffff
} rtcc_optimization;

typedef struct rtcc_compiler* rtcc_compiler_t;
typedef struct rtcc_options* rtcc_options_t;
typedef struct rtcc_pipeline* rtcc_pipeline_t;
typedef struct rtcc_result* rtcc_result_t;
typedef const struct rtcc_compiler* rtcc_const_compiler_t;
typedef const struct rtcc_options* rtcc_const_options_t;
typedef const struct rtcc_pipeline* rtcc_const_pipeline_t;
typedef const struct rtcc_result* rtcc_const_result_t;

/* ---- Version ----------------------------------------------------------------- */

/* "0.1.0" */
RTCC_EXPORT const char* rtcc_version(void);
/* RTC_ABI_VERSION of the library, to be compared with the one in the header. */
RTCC_EXPORT uint32_t rtcc_abi_version(void);
/* The version of the GLSL front end inside, e.g. "glslang 12.0.0". */
RTCC_EXPORT const char* rtcc_front_end_version(void);

/* ---- Compiler ---------------------------------------------------------------- */

/* Holds what compilations share; creating one is cheap. */
RTCC_EXPORT rtcc_compiler_t rtcc_compiler_create(void);
RTCC_EXPORT void rtcc_compiler_release(rtcc_compiler_t compiler);

/* ---- Options ----------------------------------------------------------------- */

/* The defaults. NULL: out of memory. Not to be changed by one thread while others use them. */
RTCC_EXPORT rtcc_options_t rtcc_options_create(void);
/* A copy that shares nothing with the original, except the include callbacks'
 * user data pointer. NULL gives fresh options. */
RTCC_EXPORT rtcc_options_t rtcc_options_clone(rtcc_const_options_t options);
RTCC_EXPORT void rtcc_options_release(rtcc_options_t options);

/* Defines a preprocessor macro for every GLSL source, as -DNAME=VALUE does; `value`
 * NULL or "" defines it empty. A later definition of a name replaces the earlier. */
RTCC_EXPORT rtcc_status rtcc_options_add_macro(rtcc_options_t options, const char* name, const char* value);
/* Forgets an earlier macro of that name and undefines a predefined one, as -UNAME. */
RTCC_EXPORT rtcc_status rtcc_options_undefine_macro(rtcc_options_t options, const char* name);

/* Without include callbacks, #include "x" is looked up in the including file's folder,
 * then in these folders in the order given; #include <x> only in the folders. */
RTCC_EXPORT rtcc_status rtcc_options_add_include_directory(rtcc_options_t options, const char* path);

typedef enum rtcc_include_type { RTCC_INCLUDE_QUOTED = 0, RTCC_INCLUDE_ANGLED = 1 } rtcc_include_type;

typedef struct rtcc_include_result {
    const char* name; /* resolved name, for messages and dependencies; "" or NULL: not found */
    size_t name_size;
    const char* content; /* the source, or the error message when not found */
    size_t content_size;
    void* user_data; /* yours */
} rtcc_include_result;

/* Finds an include. `includer` is the resolved name of the including source and `depth`
 * counts from 1. Runs in the thread that compiles; several may compile at once. A quoted
 * include that is not found is asked for again as an angled one. Returning NULL means not
 * found. Must not throw and must not call back into the objects being compiled. */
typedef rtcc_include_result* (*rtcc_include_resolve_fn)(void* user_data, const char* requested,
                                                        rtcc_include_type type, const char* includer,
                                                        size_t depth);
/* Takes a result of the resolver back, once, after its content was copied. */
typedef void (*rtcc_include_release_fn)(void* user_data, rtcc_include_result* result);

/* Replaces file system look-up for #include. NULL for both restores it. */
RTCC_EXPORT rtcc_status rtcc_options_set_include_callbacks(rtcc_options_t options,
                                                           rtcc_include_resolve_fn resolve,
                                                           rtcc_include_release_fn release, void* user_data);

/* Overrides #version: "460", "460core", "450". NULL or "" lets the sources say it. */
RTCC_EXPORT rtcc_status rtcc_options_set_glsl_version(rtcc_options_t options, const char* version);
/* Keeps names, lines and source text in the output (-g). Default 0. Reports have lines either way. */
RTCC_EXPORT rtcc_status rtcc_options_set_debug_info(rtcc_options_t options, int enable);
RTCC_EXPORT rtcc_status rtcc_options_set_optimization(rtcc_options_t options, rtcc_optimization level);
/* How exact traversal is: --accuracy. The default is RTCC_ACCURACY_WATERTIGHT. What each
 * promises and costs: docs/accuracy.md. */
RTCC_EXPORT rtcc_status rtcc_options_set_accuracy(rtcc_options_t options, rtcc_accuracy accuracy);
/* What the finished module may use. Independent of how the stages were written. */
RTCC_EXPORT rtcc_status rtcc_options_set_target_env(rtcc_options_t options, rtcc_target_env target);
/* Trace calls nested in trace calls: 1 (only ray generation traces) to 31. Default 1. */
RTCC_EXPORT rtcc_status rtcc_options_set_max_recursion_depth(rtcc_options_t options, uint32_t depth);
/* Callables nested in callables, 0 to 31; 0 takes it from the call graph (needed when that is cyclic). */
RTCC_EXPORT rtcc_status rtcc_options_set_max_callable_depth(rtcc_options_t options, uint32_t depth);
/* Where rtc's own descriptors go: a set of their own (default: one above the highest
 * used) or, with `binding`, behind the application's bindings of a set. set -1: the default. */
RTCC_EXPORT rtcc_status rtcc_options_set_reserved(rtcc_options_t options, int32_t set, uint32_t binding);
/* Run the SPIR-V validator on the result. Default 1. */
RTCC_EXPORT rtcc_status rtcc_options_set_validate(rtcc_options_t options, int enable);
/* How acceleration structures are reached: through one bound heap (the default, plain Vulkan 1.1), or by
 * device address, which needs bufferDeviceAddress and lifts the heap's size limits. The runtime's
 * acceleration structures must be bound the same way. */
RTCC_EXPORT rtcc_status rtcc_options_set_addressing(rtcc_options_t options, rtcc_addressing addressing);
/* GLSL that is accepted beside the extensions as published. Default none. With GDC2019: blocks without an instance
 * used by their block's name, a missing `;` after a block, a missing `uniform` before opaque types,
 * gl_GlobalInvocationIDNV and gl_hitTNV. Included files are taken as they are. */
RTCC_EXPORT rtcc_status rtcc_options_set_compat(rtcc_options_t options, rtcc_compat compat);
/* The checking variant of traversal: what it reads of acceleration structures is checked before it is followed, and
 * damage sets the launch error RTC_LAUNCH_ERROR_BAD_MEMORY. Slower; for debugging, beside
 * RtrDeviceCreateInfo::validation. Default 0. */
RTCC_EXPORT rtcc_status rtcc_options_set_checked(rtcc_options_t options, int enable);
/* Lanes can suspend and be resumed by a later dispatch. Default 1. */
RTCC_EXPORT rtcc_status rtcc_options_set_resumable(rtcc_options_t options, int enable);
/* Promises about every scene that the pipeline will trace, as names separated by commas or
 * blanks: "opaque", "single-level", "identity-transforms", "no-masks", "no-instance-flags",
 * "triangles", "aabbs" (docs/specialisation.md). They add to earlier ones and remove code. A
 * scene that breaks one is not traced: launch error RTC_LAUNCH_ERROR_ASSUMPTION.
 * RTCC_STATUS_INVALID_ARGUMENT for a name that does not exist. */
RTCC_EXPORT rtcc_status rtcc_options_assume(rtcc_options_t options, const char* names);
/* The same from a scene profile, JSON text that rtrWriteSceneProfile made. */
RTCC_EXPORT rtcc_status rtcc_options_add_scene_profile(rtcc_options_t options, const char* json, size_t size);
/* The names rtcc_options_assume knows; NULL past the end. */
RTCC_EXPORT const char* rtcc_assumption_name(size_t index);
/* Remove what the pipeline's code and the assumptions show not to be needed. Default 1; 0 is
 * for comparison, and ignores assumptions. */
RTCC_EXPORT rtcc_status rtcc_options_set_specialize(rtcc_options_t options, int enable);
/* For measuring what one fact is worth: the fact of this name (rtcc_fact_info::name: "ray flags",
 * "cull mask", "opaque", ...) counts as unknown, and the code that it would remove stays. Facts
 * that follow from the pipeline's shape ("recursion depth", "no shader records", "built-ins read",
 * and "no any-hit" or "no procedural geometry" where there is no such shader) cannot be left
 * out. Scenes are checked for all assumptions as before. RTCC_STATUS_INVALID_ARGUMENT for an empty name. */
RTCC_EXPORT rtcc_status rtcc_options_ignore_fact(rtcc_options_t options, const char* name);
RTCC_EXPORT rtcc_status rtcc_options_set_warnings_as_errors(rtcc_options_t options, int enable);
RTCC_EXPORT rtcc_status rtcc_options_set_suppress_warnings(rtcc_options_t options, int enable);
/* For rtc's own tests: print the module after the pass of that name (rtcc_result_text) and stop. */
RTCC_EXPORT rtcc_status rtcc_options_set_stop_after(rtcc_options_t options, const char* pass);

/* ---- Pipelines --------------------------------------------------------------- */

/* A list of stages and a list of groups, both in the order added. Group number n of
 * the list is group n of the shader binding table helpers and of the reflection. */
RTCC_EXPORT rtcc_pipeline_t rtcc_pipeline_create(void);
RTCC_EXPORT void rtcc_pipeline_release(rtcc_pipeline_t pipeline);

/* Adds a stage from GLSL text. `name` must be unique in the pipeline; reports and
 * reflection use it. NULL or "" takes `file`. `file` is used in messages and, by its folder,
 * for #include; it is not opened. Returns the stage's index, or -1 (invalid argument, a name
 * used before, no memory). GLSL is compiled when the pipeline is. */
RTCC_EXPORT int32_t rtcc_pipeline_add_glsl(rtcc_pipeline_t pipeline, rtcc_stage stage, const char* name,
                                           const char* file, const char* source, size_t source_size);
/* Adds a stage from SPIR-V words. `entry` NULL: the module's only ray tracing entry
 * point of that stage. One module may be added several times. */
RTCC_EXPORT int32_t rtcc_pipeline_add_spirv(rtcc_pipeline_t pipeline, rtcc_stage stage, const char* name,
                                            const char* file, const uint32_t* words, size_t word_count,
                                            const char* entry);

/* Fixes a specialisation constant of one stage; `bits` is the bit pattern of its type. */
RTCC_EXPORT rtcc_status rtcc_pipeline_specialize(rtcc_pipeline_t pipeline, int32_t stage, uint32_t constant_id,
                                                 uint64_t bits);
/* The same with a value as text ("3", "-1", "0x10", "1.5", "true"), read by the constant's
 * type when the pipeline is compiled; a value or id that does not fit is an error then. */
RTCC_EXPORT rtcc_status rtcc_pipeline_specialize_text(rtcc_pipeline_t pipeline, int32_t stage,
                                                      uint32_t constant_id, const char* value);

/* Groups of one ray generation, miss or callable stage. Returns the group's index or -1.
 * `name` must be unique; NULL or "": the stage's name. */
RTCC_EXPORT int32_t rtcc_pipeline_add_general_group(rtcc_pipeline_t pipeline, const char* name, int32_t stage);
/* Hit groups; -1 where there is no such stage (all -1: a group that shades nothing). With an
 * intersection stage the group is procedural, else it is for triangles. */
RTCC_EXPORT int32_t rtcc_pipeline_add_hit_group(rtcc_pipeline_t pipeline, const char* name, int32_t closest_hit,
                                                int32_t any_hit, int32_t intersection);

/* ---- Compiling --------------------------------------------------------------- */

/* Options may be NULL in all of them. */

/* The whole journey: every stage to SPIR-V, then all into one compute module. */
RTCC_EXPORT rtcc_result_t rtcc_compile_pipeline(rtcc_const_compiler_t compiler,
                                                rtcc_const_pipeline_t pipeline,
                                                rtcc_const_options_t options);
/* One GLSL stage to SPIR-V, not linked: NV sources to SPIR-V 1.3 (Vulkan 1.1), EXT
 * sources to 1.4 (Vulkan 1.2). */
RTCC_EXPORT rtcc_result_t rtcc_compile_stage(rtcc_const_compiler_t compiler, rtcc_stage stage,
                                             const char* file, const char* source, size_t source_size,
                                             rtcc_const_options_t options);
/* One GLSL stage through the preprocessor; the text is rtcc_result_text. */
RTCC_EXPORT rtcc_result_t rtcc_preprocess_stage(rtcc_const_compiler_t compiler, rtcc_stage stage,
                                                const char* file, const char* source, size_t source_size,
                                                rtcc_const_options_t options);
/* Reads the reflection that a finished module carries. The result's words are the module's. */
RTCC_EXPORT rtcc_result_t rtcc_reflect_module(rtcc_const_compiler_t compiler, const char* file,
                                              const uint32_t* words, size_t word_count);

/* ---- SPIR-V helpers ------------------------------------------------------------ */

/* 1 when the bytes begin with SPIR-V's magic number, in either endianness. */
RTCC_EXPORT int rtcc_is_spirv(const void* bytes, size_t size);
/* A module from a file's bytes, in either endianness and at any alignment: words in the
 * result, or RTCC_STATUS_INVALID_SPIRV with a message. Checks the framing of every
 * instruction, not their meaning. */
RTCC_EXPORT rtcc_result_t rtcc_module_from_bytes(const char* file, const void* bytes, size_t size);
/* The stage of a module's entry point (`entry` NULL: of its only ray tracing entry point);
 * RTCC_STAGE_AUTO when there is none or more than one. */
RTCC_EXPORT rtcc_stage rtcc_module_stage(const uint32_t* words, size_t word_count, const char* entry);
/* What RTCC_STAGE_AUTO takes from a file name; RTCC_STAGE_AUTO when it tells nothing. */
RTCC_EXPORT rtcc_stage rtcc_stage_from_file_name(const char* file);
/* What RTCC_STAGE_AUTO finds for a GLSL source; RTCC_STAGE_AUTO when compiling it would be
 * RTCC_STATUS_INVALID_STAGE. */
RTCC_EXPORT rtcc_stage rtcc_stage_from_source(const char* file, const char* source, size_t source_size);
/* "rgen" or "raygen" and so on; RTCC_STAGE_AUTO for anything else. */
RTCC_EXPORT rtcc_stage rtcc_stage_from_name(const char* name);
/* "rgen", "rint", "rahit", "rchit", "rmiss", "rcall"; "auto" for anything else. */
RTCC_EXPORT const char* rtcc_stage_name(rtcc_stage stage);

/* ---- Results ----------------------------------------------------------------- */

/* And everything it handed out. NULL is ignored. */
RTCC_EXPORT void rtcc_result_release(rtcc_result_t result);
/* RTCC_STATUS_INTERNAL_ERROR for NULL. */
RTCC_EXPORT rtcc_status rtcc_result_status(rtcc_const_result_t result);
/* The module; count 0 and NULL unless the status is success. */
RTCC_EXPORT const uint32_t* rtcc_result_words(rtcc_const_result_t result);
RTCC_EXPORT size_t rtcc_result_word_count(rtcc_const_result_t result);
/* Preprocessed source, or the dump asked for by rtcc_options_set_stop_after; "" otherwise. */
RTCC_EXPORT const char* rtcc_result_text(rtcc_const_result_t result);
RTCC_EXPORT size_t rtcc_result_text_size(rtcc_const_result_t result);
/* The module as assembly. Made on the first call; "" when there is no module. Unlike the
 * other accessors it changes the result: not at the same time from two threads. */
RTCC_EXPORT const char* rtcc_result_assembly(rtcc_result_t result);

typedef struct rtcc_diagnostic {
    rtcc_severity severity;
    const char* id;   /* stable kebab-case name, e.g. "trace-location-unknown" */
    const char* file; /* "" when the message belongs to no file */
    uint32_t line;    /* 0: not known */
    const char* text;
} rtcc_diagnostic;

/* Errors and warnings, in the order they were found. */
RTCC_EXPORT size_t rtcc_result_diagnostic_count(rtcc_const_result_t result);
/* Empty strings and zeros for an index out of range. */
RTCC_EXPORT rtcc_diagnostic rtcc_result_diagnostic(rtcc_const_result_t result, size_t index);
/* All diagnostics as "file:line: error: text" lines, "" when there are none. */
RTCC_EXPORT const char* rtcc_result_messages(rtcc_const_result_t result);
RTCC_EXPORT size_t rtcc_result_warning_count(rtcc_const_result_t result);
RTCC_EXPORT size_t rtcc_result_error_count(rtcc_const_result_t result);

/* Files the result depends on: each source, then what it includes; each once. NULL past the end. */
RTCC_EXPORT size_t rtcc_result_dependency_count(rtcc_const_result_t result);
RTCC_EXPORT const char* rtcc_result_dependency(rtcc_const_result_t result, size_t index);

/* ---- Reflection -------------------------------------------------------------- */

/* Later versions add members at the ends only. */

typedef struct rtcc_stage_info {
    rtcc_stage stage;
    const char* name;
    const char* file;
    uint32_t first_state; /* its states in the dispatch loop are [first_state, first_state + state_count) */
    uint32_t state_count;
    uint32_t payload_words; /* of its incoming payload or callable data */
    uint32_t record_bytes;  /* of its shader record block; 0: none */
} rtcc_stage_info;

typedef struct rtcc_group_info {
    rtcc_group_kind kind;
    const char* name;
    uint32_t handle[RTC_HANDLE_WORDS]; /* what the shader binding table holds */
} rtcc_group_info;

typedef struct rtcc_resource_info {
    const char* name;
    const char* stage;
    uint32_t set;
    uint32_t binding;
    const char* type; /* "storage-buffer", "uniform-buffer", "storage-image", "sampled-image", "sampler",
                         "combined-image-sampler", "uniform-texel-buffer", "storage-texel-buffer",
                         "input-attachment", "acceleration-structure" (bound as a storage buffer) */
    uint32_t array_size; /* 0: runtime array */
} rtcc_resource_info;

typedef struct rtcc_spec_constant_info {
    const char* stage;
    const char* name;
    uint32_t original_id; /* in the stage's source */
    uint32_t id;          /* in the module */
    const char* type;     /* "bool", "int32", "uint32", "float32", ... */
    uint64_t default_value;
} rtcc_spec_constant_info;

typedef struct rtcc_trace_site_info {
    const char* stage;
    const char* file;
    uint32_t line;
    int callable;         /* executeCallable, not a trace */
    uint32_t frame_bytes; /* live state saved across the call */
    size_t variable_count; /* source names of what is saved */
    const char* const* variables;
} rtcc_trace_site_info;

/* One thing that is known about the pipeline's rays or scenes, or that is not. */
typedef struct rtcc_fact_info {
    const char* name;   /* "no any-hit", "cull mask", "single-level", ... */
    const char* state;  /* "proven" by the code, "assumed" by the user, "unknown" */
    const char* detail; /* why, and what was removed for it */
} rtcc_fact_info;

typedef struct rtcc_reflection {
    size_t stage_count;
    const rtcc_stage_info* stages;
    size_t group_count;
    const rtcc_group_info* groups;
    size_t resource_count;
    const rtcc_resource_info* resources;
    size_t spec_constant_count;
    const rtcc_spec_constant_info* spec_constants;
    size_t trace_site_count;
    const rtcc_trace_site_info* trace_sites;
    size_t required_feature_count; /* Vulkan feature names, e.g. "shaderFloat64" */
    const char* const* required_features;
    uint32_t flags;    /* RTC_MODULE_* */
    rtcc_accuracy accuracy;
    uint32_t identity; /* word 7 of the handles */
    uint32_t reserved_set;
    uint32_t reserved_binding;
    uint32_t used_bindings; /* bit n: RTC_BINDING_* n is declared, at reserved_binding + n */
    uint32_t push_constant_bytes;
    uint32_t state_count;
    uint32_t max_recursion_depth;
    uint32_t max_callable_depth;
    uint32_t stack_words;   /* word stack of a lane, inside the shader */
    uint32_t scratch_words; /* words a lane needs in RTC_BINDING_SCRATCH */
    uint32_t payload_words;
    uint32_t attribute_words;
    uint32_t callable_words;
    uint32_t spirv_version; /* word 1 of the module */
    uint32_t instruction_count;
    size_t fact_count;
    const rtcc_fact_info* facts;
    uint32_t assumptions; /* RTC_FACT_* that scenes must meet, see RTC_FACTS_OF_ABSENCE */
} rtcc_reflection;

/* NULL unless the status is success and the result is a linked module. */
RTCC_EXPORT const rtcc_reflection* rtcc_result_reflection(rtcc_const_result_t result);
/* The same as JSON; "" where rtcc_result_reflection is NULL. */
RTCC_EXPORT const char* rtcc_result_reflection_json(rtcc_const_result_t result);

#ifdef __cplusplus
}
#endif

#endif /* RTC_COMPILER_H_ */
