// Runs the rtc program in a folder of its own and looks at what comes out.
#pragma once

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

struct CliRun {
    int status = -1;
    std::string out, err;
};

class Cli : public ::testing::Test {
  protected:
    Cli();
    ~Cli() override;

    // `arguments` goes through the shell, with the folder as working directory.
    CliRun rtc(const std::string& arguments, const std::string& standard_input = "");
    CliRun rtc_in(const std::string& folder, const std::string& arguments);

    void write(const std::string& name, const std::string& text) const;
    std::string read(const std::string& name) const;
    bool exists(const std::string& name) const;
    // Copies the NV ("nv") or EXT ("ext") set of testdata/shaders/cli here.
    void copy_shaders(const std::string& dialect, const std::string& folder = ".") const;

    std::filesystem::path folder_;
};

// Sources small enough to stand in a test.
std::string miss_shader(const std::string& body = "");
std::string raygen_shader(const std::string& body = "");

std::vector<uint32_t> words_of(const std::string& bytes);
bool is_module(const std::string& bytes);
// The whole module as text, and whether SPIRV-Tools finds it valid for vulkan1.1 … 1.3.
std::string disassembled(const std::string& bytes);
bool is_valid_for(const std::string& bytes, const std::string& environment);
