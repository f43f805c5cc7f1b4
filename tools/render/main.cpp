// rtc-render: draws scenes with ray tracing shaders on plain Vulkan compute.
#include <cstdio>
#include <fstream>

#include "command_line.h"
#include "demo.h"
#include "error.h"
#include "image_file.h"
#include "renderer.h"
#ifdef RTC_RENDER_NATIVE
#include "comparison.h"
#include "native_renderer.h"
#include "recorded.h"
#endif

namespace {

using namespace rtc::tools;

std::string joined(const std::vector<std::string>& words) {
    std::string text;
    for (const std::string& word : words) text += (text.empty() ? "" : ", ") + word;
    return text;
}

struct Arguments {
    std::string scene = "builtin:cornell", integrator = "path", dialect = "nv", addressing, device, output, demo_folder;
    std::vector<float> eye, target;
    float field_of_view = 0, exposure = 1;
    std::string native, json;
    bool validate = false, demo = false, compare = false, classify = false;
    RenderOptions render;
};

void set_camera(const Arguments& arguments, Camera& camera) {
    if (!arguments.eye.empty()) camera.eye = {arguments.eye[0], arguments.eye[1], arguments.eye[2]};
    if (!arguments.target.empty())
        camera.target = {arguments.target[0], arguments.target[1], arguments.target[2]};
    if (arguments.field_of_view > 0) camera.fov_y = glm::radians(arguments.field_of_view);
}

void save(const Arguments& arguments, RenderResult& result) {
    if (arguments.output.empty()) return;
    for (size_t i = 0; i < result.picture.pixels.size(); ++i)
        if (i % 4 != 3) result.picture.pixels[i] *= arguments.exposure;
    write_picture(arguments.output, result.picture);
    std::printf("wrote %s (compile %.2f s, build %.2f s, trace %.2f s)\n", arguments.output.c_str(),
                result.compile_seconds, result.build_seconds, result.trace_seconds);
}

Scene scene_of(const Arguments& arguments) {
    Scene scene = load_scene(arguments.scene);
    set_camera(arguments, scene.camera);
    return scene;
}

#ifdef RTC_RENDER_NATIVE
void write_text(const std::string& path, const std::string& text) {
    std::ofstream file(path, std::ios::binary);
    file << text;
    file.close();
    if (!file) throw Error("cannot write " + path);
}

// The device's own ray tracing alone, or beside rtc on the same device with the same shaders.
int draw_natively(Arguments& arguments) {
    const bool khr = arguments.native == "khr";
    rtc::native::Requirements needs(khr ? rtc::native::Requirements::Kind::Khr
                                        : rtc::native::Requirements::Kind::Nv);
    ContextOptions options;
    options.device = arguments.device;
    options.validate = arguments.validate;
    needs.apply(options);
    Context context(options);
    const Scene scene = scene_of(arguments);
    RenderOptions& render_options = arguments.render;
    render_options.settings.ext_dialect = khr;
    render_options.keep_gbuffer = arguments.compare;
    RenderResult peer = render_natively(context, scene, render_options);
    bool passed = true;
    if (arguments.compare) {
        RtcDevice device(context);
        RenderResult ours = render(device, scene, render_options);
        const Comparison comparison = compare(peer, ours);
        std::printf("%s", as_text(comparison).c_str());
        passed = comparison.passed();
        std::string report = "{\"scene\": \"" + scene.name + "\", \"integrator\": \"" + arguments.integrator +
                             "\", \"native\": \"" + arguments.native + "\", \"device\": \"" +
                             describe_device(context.properties, context.driver) + "\", \"width\": " +
                             std::to_string(render_options.settings.width) + ", \"height\": " +
                             std::to_string(render_options.settings.height) + ", \"launches\": " +
                             std::to_string(render_options.samples) + ",\n \"pictures\": " + as_json(comparison);
        if (arguments.classify) {
            const Recorded recorded = compare_recorded(device, scene, render_options);
            std::printf("%s", recorded.text.c_str());
            passed = passed && recorded.passed;
            report += ",\n " + recorded.json;
        }
        if (!arguments.json.empty()) write_text(arguments.json, report + "}\n");
        save(arguments, ours);
    } else {
        save(arguments, peer);
    }
    context.require_silent_validation();
    return passed ? 0 : 1;
}
#else
int draw_natively(Arguments&) { throw Error("this build has no native executors"); }
#endif

int draw(Arguments& arguments) {
    if (!arguments.native.empty()) return draw_natively(arguments);
    ContextOptions options;
    options.device = arguments.device;
    options.validate = arguments.validate;
    Context context(options);
    {
        RtcDevice device(context);
        if (arguments.demo) {
            draw_demo(device, arguments.demo_folder, arguments.render);
        } else {
            RenderResult result = render(device, scene_of(arguments), arguments.render);
            save(arguments, result);
        }
    }
    context.require_silent_validation();
    return 0;
}

}  // namespace

int main(int argc, char** argv) {
    Arguments arguments;
    RenderOptions& render = arguments.render;
    CLI::App app{"Draws scenes with GLSL ray tracing shaders, compiled by rtc to plain Vulkan compute."};
    app.add_option("--scene", arguments.scene,
                   "a .gltf, .glb or .obj file, or builtin:NAME (" + joined(builtin_scene_names()) + ")")
        ->capture_default_str();
    app.add_option("--integrator", arguments.integrator, joined(integrator_names()))->capture_default_str();
    app.add_option("--width", render.settings.width, "pixels")->capture_default_str();
    app.add_option("--height", render.settings.height, "pixels")->capture_default_str();
    app.add_option("--samples", render.samples, "launches, one jittered sample a pixel each")
        ->capture_default_str()
        ->check(CLI::Range(1, 1 << 24));
    app.add_option("-o,--output", arguments.output, "picture to write: .png, .exr or .pfm");
    app.add_option("--device", arguments.device,
                   "index or part of the name; default: $RTC_DEVICE, else the best");
    app.add_flag("--validate", arguments.validate,
                 "Vulkan validation; any message is an error (also RTC_VALIDATION=1)");
    app.add_option("--max-bounces", render.settings.max_bounces, "of a path")->capture_default_str();
    app.add_option("--shadow-samples", render.settings.shadow_samples, "shadow rays a launch")
        ->capture_default_str();
    app.add_option("--ao-samples", render.settings.ao_samples, "occlusion rays a launch")
        ->capture_default_str();
    app.add_option("--ao-radius", render.settings.ao_radius, "0: a quarter of the scene");
    app.add_option("--eye", arguments.eye, "camera position: X Y Z")->expected(3);
    app.add_option("--target", arguments.target, "what it looks at: X Y Z")->expected(3);
    app.add_option("--fov", arguments.field_of_view, "vertical field of view, degrees")
        ->check(number_between(0.01, 179));
    app.add_option("--exposure", arguments.exposure, "factor on the picture")
        ->capture_default_str()
        ->check(number_between(1e-6, 1e6));
    app.add_option("--dialect", arguments.dialect, "shaders to compile: nv or ext")
        ->capture_default_str()
        ->check(CLI::IsMember({"nv", "ext"}));
    app.add_option("--addressing", arguments.addressing,
                   "acceleration structures in a heap or by address (default: as the device recommends)")
        ->check(CLI::IsMember({"heap", "address"}));
    app.add_option("--shaders", render.settings.shader_folder, "folder of the shaders (also RTC_SHADERS)");
    app.add_option("--module", render.modules,
                   "precompiled module, one for each pass, instead of the shaders");
    app.add_option("--save-modules", render.save_modules, "folder to keep the compiled modules in");
    app.add_flag("--fast-build", render.fast_build, "prefer build speed to trace speed");
    app.add_flag("!--no-optimize", render.optimize, "compile without -O");
    app.add_flag("--quiet", render.quiet, "no progress");
    app.add_option("--native", arguments.native, "draw with the device's own extension: nv or khr")
        ->check(CLI::IsMember({"nv", "khr"}));
    app.add_flag("--compare", arguments.compare, "with --native: draw with rtc too and compare");
    app.add_flag("--classify", arguments.classify,
                 "with --compare: record every ray on both sides and judge the first that parts by exact "
                 "arithmetic");
    app.add_option("--json", arguments.json, "with --compare: write the figures to this file");
    app.add_flag("--demo", arguments.demo, "draw the three demo pictures");
    app.add_option("--out-dir", arguments.demo_folder, "where --demo writes")->default_str("out/demo");
    if (const int status = rtc::tools::parse_command_line(app, "rtc-render", argc, argv); status >= 0) return status;
    if (arguments.demo_folder.empty()) arguments.demo_folder = "out/demo";
    return run_program("rtc-render", [&] {
        if (arguments.output.empty() && !arguments.demo && !arguments.compare)
            throw Error("-o FILE, --compare or --demo is needed");
        if (!arguments.output.empty() && !can_write_picture(arguments.output))
            throw Error(arguments.output + ": pictures are written as .png, .exr or .pfm");
        if (!arguments.output.empty()) require_writable(arguments.output);
        if (!arguments.json.empty()) require_writable(arguments.json);
        if (arguments.classify && !arguments.compare) throw Error("--classify needs --compare");
        if (!arguments.json.empty() && !arguments.compare) throw Error("--json needs --compare");
        if (arguments.compare && arguments.native.empty()) throw Error("--compare needs --native=nv or khr");
        render.settings.integrator = integrator_from_name(arguments.integrator);
        render.settings.ext_dialect = arguments.dialect == "ext";
        render.addressing = addressing_from_name(arguments.addressing);
        return draw(arguments);
    });
}
