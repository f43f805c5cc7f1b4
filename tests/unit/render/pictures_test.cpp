// Pictures written and read back.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <fstream>

#include "error.h"
#include "image_file.h"

namespace rtc::tools {
namespace {

Picture ramp(uint32_t channels) {
    Picture picture(5, 3, channels);
    for (uint32_t y = 0; y < 3; ++y)
        for (uint32_t x = 0; x < 5; ++x)
            for (uint32_t c = 0; c < channels; ++c)
                picture.at(x, y)[c] = c == 3 ? 1.0f : 0.01f * float(x) + 0.3f * float(y) + 0.05f * float(c);
    return picture;
}

std::string temporary(const char* name) { return testing::TempDir() + "rtc_" + name; }

TEST(Pictures, PfmKeepsEveryBitAndTheRowOrder) {
    const std::string path = temporary("ramp.pfm");
    const Picture written = ramp(3);
    write_picture(path, written);
    const Picture read = read_picture(path);
    ASSERT_EQ(read.channels, 3u);
    EXPECT_EQ(read.pixels, written.pixels);
}

TEST(Pictures, ExrKeepsEveryBit) {
    const std::string path = temporary("ramp.exr");
    Picture written = ramp(4);
    written.at(1, 1)[0] = 1234.5f;  // beyond any 8-bit format
    write_picture(path, written);
    const Picture read = read_picture(path);
    ASSERT_EQ(read.width, 5u);
    EXPECT_EQ(read.pixels, written.pixels);
}

TEST(Pictures, PngGoesThroughTheSrgbCurveAndBack) {
    const std::string path = temporary("ramp.png");
    const Picture written = ramp(4);
    write_picture(path, written);
    const Picture read = read_picture(path);
    for (size_t i = 0; i < written.pixels.size(); ++i)
        EXPECT_NEAR(read.pixels[i], written.pixels[i], 0.006f);  // half a step where the curve is flattest
    // Linear 0.2159 is 128 in sRGB.
    Picture grey(1, 1, 3);
    grey.pixels = {0.2159f, 0.2159f, 0.2159f};
    write_picture(path, grey);
    EXPECT_FLOAT_EQ(read_picture(path, false).pixels[0], 128.0f / 255.0f);
}

TEST(Pictures, PngClampsWhatItCannotHold) {
    const std::string path = temporary("wild.png");
    Picture wild(3, 1, 3);
    wild.pixels = {-1, -1, -1, 7, 7, 7, std::nanf(""), 0, 0};
    write_picture(path, wild);
    const Picture read = read_picture(path);
    EXPECT_EQ(read.at(0, 0)[0], 0.0f);
    EXPECT_EQ(read.at(1, 0)[0], 1.0f);
    EXPECT_EQ(read.at(2, 0)[0], 0.0f);
}

TEST(Pictures, BadFilesAreErrors) {
    EXPECT_THROW(write_picture(temporary("picture.gif"), ramp(3)), Error);
    EXPECT_THROW(write_picture("/nowhere/at/all.png", ramp(3)), Error);
    EXPECT_THROW(write_picture("/nowhere/at/all.pfm", ramp(3)), Error);
    EXPECT_THROW(read_picture("/nowhere/at/all.png"), Error);
    const std::string path = temporary("short.pfm");
    std::ofstream(path) << "PF\n100 100\n-1.0\nabc";
    EXPECT_THROW(read_picture(path), Error);
    std::ofstream(path) << "P6\n1 1\n255\n";
    EXPECT_THROW(read_picture(path), Error);
}

}  // namespace
}  // namespace rtc::tools
