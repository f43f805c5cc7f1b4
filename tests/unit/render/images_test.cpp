// Pictures drawn on the device, against what geometry and radiometry say they must be. The random
// sequence is fixed, so the statistical bounds either hold always or never.
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <limits>

#include "mesh_tools.h"
#include "renderer.h"

namespace rtc::tools {
namespace {

class Images : public testing::Test {
  protected:
    static void SetUpTestSuite() {
        context = std::make_unique<Context>();
        device = std::make_unique<RtcDevice>(*context);
    }
    static void TearDownTestSuite() {
        device.reset();
        if (context) {
            EXPECT_TRUE(context->validation_messages().empty());
        }
        context.reset();
    }

    static RenderOptions options(Integrator integrator, uint32_t size, uint32_t samples) {
        RenderOptions options;
        options.settings.integrator = integrator;
        options.settings.width = options.settings.height = size;
        options.samples = samples;
        options.quiet = true;
        return options;
    }

    static std::unique_ptr<Context> context;
    static std::unique_ptr<RtcDevice> device;
};

std::unique_ptr<Context> Images::context;
std::unique_ptr<RtcDevice> Images::device;

struct Statistics {
    double mean, standard_error;
};

Statistics statistics(const std::vector<double>& values) {
    double sum = 0, squares = 0;
    for (double value : values) sum += value;
    const double mean = sum / double(values.size());
    for (double value : values) squares += (value - mean) * (value - mean);
    return {mean, std::sqrt(squares / double(values.size() - 1) / double(values.size()))};
}

TEST_F(Images, WhiteFurnaceMeanIsOne) {
    const RenderResult result =
        render(*device, load_scene("builtin:furnace"), options(Integrator::Path, 48, 48));
    std::vector<double> values;
    for (size_t i = 0; i < result.picture.pixels.size(); i += 4)
        values.push_back(double(result.picture.pixels[i]));
    const Statistics found = statistics(values);
    EXPECT_LT(found.standard_error, 0.005);  // else the test could not fail
    EXPECT_GT(found.standard_error, 1e-5);   // and this scene does need sampling
    EXPECT_NEAR(found.mean, 1.0, 3 * found.standard_error);
}

// Irradiance at a floor point from a horizontal rectangle of radiance 1 above it (Lambert 1760: the sum
// over the edges of angle times cosine of the edge plane's normal, halved).
double irradiance(const glm::dvec3& point, double x0, double x1, double z0, double z1, double height) {
    const glm::dvec3 corners[] = {{x0, height, z0}, {x1, height, z0}, {x1, height, z1}, {x0, height, z1}};
    double sum = 0;
    for (int i = 0; i < 4; ++i) {
        const glm::dvec3 a = glm::normalize(corners[i] - point),
                         b = glm::normalize(corners[(i + 1) % 4] - point);
        const glm::dvec3 normal = glm::cross(a, b);
        const double length = glm::length(normal);
        if (length > 0) sum += std::atan2(length, glm::dot(a, b)) * normal.y / length;
    }
    return std::abs(sum) / 2;
}

TEST_F(Images, PenumbraOfAHalfPlaneIsTheAnalyticOne) {
    constexpr uint32_t kSize = 64, kSub = 6;
    const RenderResult result =
        render(*device, load_scene("builtin:penumbra"), options(Integrator::Shadows, kSize, 32));
    // The camera sees x and z from -1 to 1; the lamp is 1 x 1 at height 4 and the half plane, half way up,
    // hides its part left of -x. Albedo 0.5, radiance 10.
    auto expected = [](double x, double z) {
        const double edge = std::max(-x, -0.5);
        return edge >= 0.5 ? 0.0 : 10.0 * 0.5 / M_PI * irradiance({x, 0, z}, edge, 0.5, -0.5, 0.5, 4.0);
    };
    std::vector<double> all;
    for (uint32_t column = 0; column < kSize; ++column) {
        std::vector<double> residuals;
        double brightest = 0;
        for (uint32_t row = 0; row < kSize; ++row) {
            double mean = 0;
            for (uint32_t k = 0; k < kSub * kSub; ++k)
                mean += expected((column + (k % kSub + 0.5) / kSub) / kSize * 2 - 1,
                                 (row + (k / kSub + 0.5) / kSub) / kSize * 2 - 1);
            const double value = double(result.picture.at(column, row)[1]);
            brightest = std::max(brightest, value);
            residuals.push_back(value - mean / (kSub * kSub));
            all.push_back(residuals.back());
        }
        if ((column + 1.0) / kSize * 2 - 1 < -0.5) {
            EXPECT_EQ(brightest, 0.0) << "in the umbra, column " << column;
        } else {
            const Statistics found = statistics(residuals);
            // 48 columns: 4.5 standard errors are exceeded by chance once in 3000 pictures.
            EXPECT_NEAR(found.mean, 0.0, 4.5 * found.standard_error + 1e-4) << "column " << column;
        }
    }
    const Statistics found = statistics(all);
    EXPECT_NEAR(found.mean, 0.0, 3 * found.standard_error);
    EXPECT_LT(found.standard_error, 1e-3);
}

TEST_F(Images, PointLightShadowsAreSharp) {
    Scene scene;
    scene.materials.resize(2);
    scene.materials[0].base_color = glm::vec3(0.5f);
    scene.meshes = {make_quad({-4, 0, -4}, {0, 0, 8}, {8, 0, 0}, 0),
                    make_quad({-20, 2, -20}, {20, 0, 0}, {0, 0, 40}, 1)};
    scene.instances.resize(2);
    scene.instances[1].mesh = 1;
    scene.lights.push_back({{0.25f, 4, 0}, glm::vec3(20.0f)});  // the shadow's edge falls on x = -0.25
    scene.camera = load_scene("builtin:penumbra").camera;
    scene.finish(true);
    constexpr uint32_t kSize = 64;
    const RenderResult result = render(*device, scene, options(Integrator::Shadows, kSize, 16));
    for (uint32_t y = 0; y < kSize; ++y)
        for (uint32_t x = 0; x < kSize; ++x) {
            const double left = double(x) / kSize * 2 - 1, right = (x + 1.0) / kSize * 2 - 1;
            const double value = double(result.picture.at(x, y)[0]);
            if (right < -0.25) {
                EXPECT_EQ(value, 0.0) << x << " " << y;
            } else if (left > -0.25) {
                const double dx = 0.5 * (left + right) - 0.25, dz = (y + 0.5) / kSize * 2 - 1;
                const double squared = dx * dx + 16 + dz * dz;
                EXPECT_NEAR(value, 0.5 / M_PI * 20 * 4 / std::pow(squared, 1.5), 2e-3) << x << " " << y;
            }
        }
}

TEST_F(Images, OcclusionByAWallIsItsFormFactor) {
    constexpr float kHeight = 1.5f;
    Scene scene;
    scene.meshes = {make_quad({-500, 0, -500}, {0, 0, 1000}, {1000, 0, 0}, 0),
                    make_quad({-1, 0, -500}, {0, kHeight, 0}, {0, 0, 1000}, 0)};
    scene.instances.resize(2);
    scene.instances[1].mesh = 1;
    scene.sky_low = scene.sky_high = glm::vec3(1);
    scene.camera = {
        {0, 1.9f, 0}, {0, 0, 0}, {0, 0, -1}, 2.0f * std::atan(0.9f / 1.9f)};  // x from -0.9 to 0.9
    scene.finish(true);
    RenderOptions wanted = options(Integrator::AmbientOcclusion, 32, 64);
    wanted.settings.ao_radius = 2000;
    const RenderResult result = render(*device, scene, wanted);
    for (uint32_t column = 0; column < 32; ++column) {
        std::vector<double> residuals;
        for (uint32_t row = 0; row < 32; ++row) {
            double open = 0;
            for (int k = 0; k < 8; ++k) {
                const double distance = 1 + ((column + (k + 0.5) / 8) / 32 * 2 - 1) * 0.9;
                open +=
                    1 -
                    0.5 * (1 - distance / std::sqrt(distance * distance + double(kHeight) * double(kHeight)));
            }
            residuals.push_back(double(result.picture.at(column, row)[0]) - open / 8);
        }
        const Statistics found = statistics(residuals);
        EXPECT_NEAR(found.mean, 0.0, 4.5 * found.standard_error) << "column " << column;
        EXPECT_LT(found.standard_error, 0.008);
    }
}

TEST_F(Images, ReflectionsEndAtDepthEight) {
    Scene scene;
    Material mirror;
    mirror.base_color = glm::vec3(1);
    mirror.metallic = 0.5f;
    mirror.roughness = 0.5f;
    scene.materials.push_back(mirror);
    scene.meshes = {make_quad({-50, -50, -1}, {100, 0, 0}, {0, 100, 0}, 0)};
    scene.instances.resize(2);
    scene.instances[1].transform[3] = glm::vec4(0, 0, 2, 1);  // two mirrors face each other
    scene.sky_low = scene.sky_high = glm::vec3(1);
    scene.camera = {{0, 0, 0}, {0, 0, -1}, {0, 1, 0}, 1e-3f};
    scene.finish(true);
    const RenderResult result = render(*device, scene, options(Integrator::Reflections, 4, 1));
    // Each surface adds 0.15 * (1 - metallic) of the sky and mirrors f0 = (0.04 + 1) / 2.
    double expected = 0;
    for (int depth = 0; depth <= 8; ++depth) expected += 0.075 * std::pow(0.52, depth);
    const double next = 0.075 * std::pow(0.52, 9);
    for (size_t i = 0; i < result.picture.pixels.size(); i += 4)
        EXPECT_NEAR(double(result.picture.pixels[i]), expected, 0.05 * next);
    EXPECT_EQ(result.rays, 16 * 9);
}

struct Hit {
    uint32_t instance = ~0u, primitive = 0;
    double t = std::numeric_limits<double>::max(), margin = 0;  // smallest barycentric
};

// Every triangle, in double.
Hit brute_force(const std::vector<std::vector<glm::dvec3>>& world, const glm::dvec3& origin,
                const glm::dvec3& direction) {
    Hit best;
    for (uint32_t i = 0; i < world.size(); ++i)
        for (uint32_t t = 0; 3 * t < world[i].size(); ++t) {
            const glm::dvec3 &a = world[i][3 * t], e1 = world[i][3 * t + 1] - a, e2 = world[i][3 * t + 2] - a;
            const glm::dvec3 p = glm::cross(direction, e2);
            const double determinant = glm::dot(e1, p);
            if (determinant == 0) continue;
            const glm::dvec3 s = origin - a, q = glm::cross(s, e1);
            const double u = glm::dot(s, p) / determinant, v = glm::dot(direction, q) / determinant;
            const double distance = glm::dot(e2, q) / determinant;
            const double margin = std::min({u, v, 1 - u - v});
            if (margin >= 0 && distance > 0 && distance < best.t) best = {i, t, distance, margin};
        }
    return best;
}

TEST_F(Images, PrimaryHitsAreThoseOfBruteForce) {
    constexpr uint32_t kSize = 48;
    const Scene scene = load_scene("builtin:cornell");
    RenderOptions wanted = options(Integrator::Primary, kSize, 1);
    wanted.keep_gbuffer = true;
    const RenderResult result = render(*device, scene, wanted);
    std::vector<uint32_t> gbuffer(kSize * kSize * 4);
    ASSERT_EQ(result.gbuffer.size(), gbuffer.size() * 4);
    std::memcpy(gbuffer.data(), result.gbuffer.data(), result.gbuffer.size());

    std::vector<std::vector<glm::dvec3>> world;
    for (const Instance& instance : scene.instances) {
        world.emplace_back();
        const Mesh& mesh = scene.meshes[instance.mesh];
        for (uint32_t index : mesh.indices)
            world.back().push_back(
                glm::dvec3(glm::dmat4(instance.transform) * glm::dvec4(mesh.positions[index], 1)));
    }
    // The jitter of random.glsl.
    auto pcg = [](uint32_t state) {
        const uint32_t word = ((state >> ((state >> 28u) + 4u)) ^ state) * 277803737u;
        return (word >> 22u) ^ word;
    };
    const glm::dvec3 eye = scene.camera.eye;
    const double scale = std::tan(0.5 * double(scene.camera.fov_y));
    uint32_t sure = 0, wrong = 0;
    for (uint32_t y = 0; y < kSize; ++y)
        for (uint32_t x = 0; x < kSize; ++x) {
            uint32_t state = pcg(x * 0x9e3779b9u + pcg(y * 0x85ebca6bu + pcg(0)));
            double jitter[2];
            for (double& value : jitter) {
                state = state * 747796405u + 2891336453u;
                value = (pcg(state) >> 8) / 16777216.0;
            }
            const glm::dvec3 direction =
                glm::normalize(glm::dvec3((double(x) + jitter[0]) / kSize * 2 - 1,
                                          1 - (double(y) + jitter[1]) / kSize * 2, 0) *
                                   scale +
                               glm::dvec3(0, 0, -1));
            const Hit hit = brute_force(world, eye, direction);
            if (hit.instance != ~0u && hit.margin < 1e-4) continue;  // floats decide edges differently
            ++sure;
            const uint32_t* found = &gbuffer[(y * kSize + x) * 4];
            if (found[0] != hit.instance || (hit.instance != ~0u && found[1] != hit.primitive)) ++wrong;
        }
    EXPECT_GT(sure, kSize * kSize * 9 / 10);
    // Silhouettes: a direction rounded to float may pass an edge on the other side.
    EXPECT_LE(wrong, 2u);
}

TEST_F(Images, BothDialectsGiveTheSamePicture) {
    const Scene scene = load_scene("builtin:cornell");
    RenderOptions wanted = options(Integrator::Path, 24, 2);
    const RenderResult nv = render(*device, scene, wanted);
    wanted.settings.ext_dialect = true;
    const RenderResult ext = render(*device, scene, wanted);
    EXPECT_EQ(nv.picture.pixels, ext.picture.pixels);
    EXPECT_EQ(nv.rays, ext.rays);
}

}  // namespace
}  // namespace rtc::tools
