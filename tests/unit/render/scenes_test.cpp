// Scene files and built-in scenes.
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>

#include "error.h"
#include "mesh_tools.h"
#include "scene.h"

namespace rtc::tools {
namespace {

std::string write_file(const std::string& name, const std::string& text) {
    const std::string path = testing::TempDir() + "rtc_" + name;
    std::ofstream(path) << text;
    return path;
}

TEST(BuiltinScenes, AllLoadAndAreConsistent) {
    for (const std::string& name : builtin_scene_names()) {
        SCOPED_TRACE(name);
        if (name == "bunny" && !std::ifstream("/usr/share/glmark2/models/bunny.obj")) continue;
        const Scene scene = load_scene("builtin:" + name);
        EXPECT_GT(scene.triangle_count(), 0u);
        for (const Mesh& mesh : scene.meshes)
            for (const glm::vec3& normal : mesh.normals) ASSERT_NEAR(glm::length(normal), 1.0f, 1e-4f);
        for (size_t i = 0; i < scene.instances.size(); ++i) ASSERT_EQ(scene.instances[i].custom_index, i);
    }
}

TEST(BuiltinScenes, UnknownNameListsTheKnownOnes) {
    try {
        load_scene("builtin:nothing");
        FAIL();
    } catch (const Error& problem) {
        EXPECT_NE(std::string(problem.what()).find("cornell"), std::string::npos);
    }
}

TEST(Obj, PolygonsMaterialsAndTextureCoordinates) {
    write_file("quad.mtl", "newmtl red\nKd 1 0 0\nnewmtl lamp\nKe 5 4 3\n");
    const std::string path = write_file("quad.obj",
                                        "mtllib rtc_quad.mtl\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n"
                                        "vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nusemtl red\nf 1/1 2/2 3/3 4/4\n"
                                        "usemtl lamp\nf 3/3 2/2 1/1\n");
    const Scene scene = load_scene(path);
    ASSERT_EQ(scene.meshes.size(), 1u);
    const Mesh& mesh = scene.meshes[0];
    ASSERT_EQ(mesh.triangle_count(), 3u);
    EXPECT_EQ(scene.materials[mesh.triangle_material(0)].base_color, glm::vec3(1, 0, 0));
    EXPECT_EQ(scene.materials[mesh.triangle_material(2)].emission, glm::vec3(5, 4, 3));
    EXPECT_EQ(mesh.uvs.size(), mesh.positions.size());
    // Without normals in the file they are computed.
    EXPECT_NEAR(std::abs(mesh.normals[mesh.indices[0]].z), 1.0f, 1e-6f);
    EXPECT_EQ(emissive_triangles(scene).size(), 1u);
}

TEST(Obj, BadFilesAreErrors) {
    EXPECT_THROW(load_scene("/nowhere.obj"), Error);
    EXPECT_THROW(load_scene(write_file("empty.obj", "# nothing\n")), Error);
    EXPECT_THROW(load_scene(write_file("index.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n")), Error);
    EXPECT_THROW(load_scene("picture.stl"), Error);
}

// Three floats a vertex and three 16-bit indices, as a data URI.
constexpr const char* kTriangleBuffer =
    "data:application/octet-stream;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAAAAABAAIA";

std::string gltf(const std::string& node, const std::string& more = "") {
    return std::string(R"({"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],"nodes":[)") + node +
           R"(],"meshes":[{"primitives":[{"attributes":{"POSITION":0},"indices":1,"material":0}]}],
        "materials":[{"pbrMetallicRoughness":{"baseColorFactor":[0.1,0.2,0.3,1],"metallicFactor":0.5,
        "roughnessFactor":0.25},"emissiveFactor":[1,0,0]}],
        "buffers":[{"byteLength":42,"uri":")" +
           kTriangleBuffer + R"("}],
        "bufferViews":[{"buffer":0,"byteOffset":0,"byteLength":36},{"buffer":0,"byteOffset":36,"byteLength":6}],
        "accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3"},
        {"bufferView":1,"componentType":5123,"count":3,"type":"SCALAR"}])" +
           more + "}";
}

TEST(Gltf, NodesMaterialsAndCamera) {
    const std::string path =
        write_file("triangle.gltf",
                   gltf(R"({"mesh":0,"translation":[1,2,3],"children":[1]},{"mesh":0,"scale":[2,2,2]},
                {"camera":0})",
                        R"(,"cameras":[{"type":"perspective","perspective":{"yfov":0.5,"znear":0.1}}])"));
    const Scene scene = load_scene(path);
    ASSERT_EQ(scene.instances.size(), 2u);
    // The child's frame is inside its parent's.
    const glm::vec4 corner = scene.instances[1].transform * glm::vec4(1, 0, 0, 1);
    EXPECT_EQ(glm::vec3(corner), glm::vec3(3, 2, 3));
    const Mesh& mesh = scene.meshes[0];
    EXPECT_EQ(mesh.positions[1], glm::vec3(1, 0, 0));
    EXPECT_EQ(mesh.indices, (std::vector<uint32_t>{0, 1, 2}));
    const Material& material = scene.materials[mesh.triangle_material(0)];
    EXPECT_FLOAT_EQ(material.base_color.y, 0.2f);
    EXPECT_FLOAT_EQ(material.metallic, 0.5f);
    EXPECT_FLOAT_EQ(material.emission.x, 1.0f);
}

TEST(Gltf, BadFilesAreErrors) {
    EXPECT_THROW(load_scene("/nowhere.gltf"), Error);
    EXPECT_THROW(load_scene(write_file("junk.gltf", "{ not json")), Error);
    EXPECT_THROW(load_scene(write_file("junk.glb", "glTF....")), Error);
    EXPECT_THROW(load_scene(write_file("node.gltf", gltf(R"({"mesh":0,"children":[7]})"))), Error);
    EXPECT_THROW(load_scene(write_file("cycle.gltf", gltf(R"({"mesh":0,"children":[0]})"))), Error);
    std::string beyond = gltf(R"({"mesh":0})");
    beyond.replace(beyond.find("\"count\":3"), 9, "\"count\":9");
    EXPECT_THROW(load_scene(write_file("beyond.gltf", beyond)), Error);
    EXPECT_THROW(
        load_scene(write_file(
            "draco.gltf", gltf(R"({"mesh":0})", R"(,"extensionsRequired":["KHR_draco_mesh_compression"])"))),
        Error);
}

TEST(Meshes, IcospheresAreClosedAndTheBoxFacesOutward) {
    const Mesh sphere = make_icosphere(2.0f, 3, 0);
    EXPECT_EQ(sphere.triangle_count(), 20u * 64u);
    EXPECT_EQ(sphere.positions.size(), 642u);  // Euler: V = F / 2 + 2
    double volume = 0;
    for (const Mesh& mesh : {make_box({-1, -2, -3}, {1, 2, 3}, 0)})
        for (size_t t = 0; t < mesh.triangle_count(); ++t)
            volume += double(glm::dot(mesh.positions[mesh.indices[3 * t]],
                                      glm::cross(mesh.positions[mesh.indices[3 * t + 1]],
                                                 mesh.positions[mesh.indices[3 * t + 2]]))) /
                      6;
    EXPECT_NEAR(volume, 48.0, 1e-4);  // positive: counter-clockwise from outside
}

TEST(Meshes, SmoothNormalsKeepCreases) {
    Mesh box = make_box(glm::vec3(-1), glm::vec3(1), 0);
    Mesh soft = box;
    add_smooth_normals(box, 45.0f);
    for (size_t i = 0; i < box.normals.size(); ++i) {
        const glm::vec3 n = glm::abs(box.normals[i]);
        EXPECT_NEAR(std::max({n.x, n.y, n.z}), 1.0f, 1e-6f);
    }
    add_smooth_normals(soft, 180.0f);
    for (size_t i = 0; i < soft.normals.size(); ++i)
        EXPECT_GT(glm::dot(soft.normals[i], soft.positions[i]), 1.3f);
}

TEST(Scenes, FinishNamesWhatIsWrong) {
    Scene scene;
    EXPECT_THROW(scene.finish(false), Error);  // empty
    Mesh mesh = make_quad({0, 0, 0}, {1, 0, 0}, {0, 1, 0}, 3);
    mesh.name = "sheet";
    scene.meshes.push_back(mesh);
    scene.instances.emplace_back();
    try {
        scene.finish(false);
        FAIL();
    } catch (const Error& problem) {
        EXPECT_NE(std::string(problem.what()).find("'sheet'"), std::string::npos);
        EXPECT_NE(std::string(problem.what()).find("material 3"), std::string::npos);
    }
    scene.meshes[0].material = 0;
    scene.finish(false);
    EXPECT_FALSE(scene.lights.empty() && scene.sky_high == glm::vec3(0));  // something shines
}

}  // namespace
}  // namespace rtc::tools
