/* Compiles a small pipeline with the installed compiler library and checks that the installed runtime speaks its ABI. */
#include <rtc/compiler.h>
#include <rtc/runtime.h>

#include <stdio.h>
#include <string.h>

static const char kRaygen[] =
    "#version 460\n"
    "#extension GL_NV_ray_tracing : require\n"
    "layout(set = 0, binding = 0) uniform accelerationStructureNV scene;\n"
    "layout(set = 0, binding = 1, rgba8) uniform image2D picture;\n"
    "layout(location = 0) rayPayloadNV vec3 color;\n"
    "void main() {\n"
    "    color = vec3(0.0);\n"
    "    traceNV(scene, 0u, 0xffu, 0u, 0u, 0u, vec3(gl_LaunchIDNV), 0.0, vec3(0.0, 0.0, 1.0), 100.0, 0);\n"
    "    imageStore(picture, ivec2(gl_LaunchIDNV.xy), vec4(color, 1.0));\n"
    "}\n";
static const char kMiss[] =
    "#version 460\n"
    "#extension GL_NV_ray_tracing : require\n"
    "layout(location = 0) rayPayloadInNV vec3 color;\n"
    "void main() { color = vec3(0.2, 0.4, 0.8); }\n";

static int fail(const char* what) {
    fprintf(stderr, "consumer: %s\n", what);
    return 1;
}

int main(void) {
    if (rtrGetAbiVersion() != RTC_ABI_VERSION || rtcc_abi_version() != RTC_ABI_VERSION)
        return fail("the libraries and the header have different ABI versions");

    rtcc_compiler_t compiler = rtcc_compiler_create();
    rtcc_pipeline_t pipeline = rtcc_pipeline_create();
    const int32_t raygen =
        rtcc_pipeline_add_glsl(pipeline, RTCC_STAGE_AUTO, "camera", "camera.rgen", kRaygen, sizeof kRaygen - 1);
    const int32_t miss = rtcc_pipeline_add_glsl(pipeline, RTCC_STAGE_MISS, "sky", "sky.glsl", kMiss, sizeof kMiss - 1);
    if (rtcc_pipeline_add_general_group(pipeline, "camera", raygen) != 0 ||
        rtcc_pipeline_add_general_group(pipeline, "sky", miss) != 1 ||
        rtcc_pipeline_add_hit_group(pipeline, "nothing", -1, -1, -1) != 2)
        return fail("the pipeline could not be described");

    rtcc_result_t result = rtcc_compile_pipeline(compiler, pipeline, NULL);
    if (rtcc_result_status(result) != RTCC_STATUS_SUCCESS) return fail(rtcc_result_messages(result));
    const rtcc_reflection* reflection = rtcc_result_reflection(result);
    if (!reflection || reflection->group_count != 3 || reflection->stage_count != 2)
        return fail("the reflection does not list the groups and stages given");
    if (reflection->groups[0].handle[0] == 0 || reflection->groups[2].handle[0] != 0)
        return fail("the handles are wrong: a shader's is zero or a null group's is not");

    /* A launch error block as the device would leave it: the third kind, twice. */
    const uint32_t block[8] = {RTC_LAUNCH_ERROR_BAD_HANDLE, 2, 7, 8, 0, 99, 0, 0};
    RtrLaunchError error;
    char text[256];
    if (rtrDecodeLaunchError(block, &error) == VK_SUCCESS || error.count != 2 || error.launchId[1] != 8)
        return fail("the launch error was not decoded");
    rtrFormatLaunchError(&error, text, sizeof text);
    if (strlen(text) == 0) return fail("the launch error has no text");

    printf("consumer: %zu words of SPIR-V, %u states, %s\n", rtcc_result_word_count(result), reflection->state_count,
           rtcc_front_end_version());
    rtcc_result_release(result);
    rtcc_pipeline_release(pipeline);
    rtcc_compiler_release(compiler);
    return 0;
}
