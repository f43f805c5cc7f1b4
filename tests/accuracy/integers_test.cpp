// The oracle's integers against rationals.
#include <gmpxx.h>
#include <gtest/gtest.h>

#include <cmath>

#include "integers.h"
#include "meshes.h"

namespace rtc::lab {
namespace {

using Q = std::array<mpq_class, 3>;

Q rational(const DVec& v) { return {mpq_class(v[0]), mpq_class(v[1]), mpq_class(v[2])}; }
Q minus(const Q& a, const Q& b) { return {a[0] - b[0], a[1] - b[1], a[2] - b[2]}; }
mpq_class determinant(const Q& x, const Q& y, const Q& z) {
    return x[0] * (y[1] * z[2] - y[2] * z[1]) + x[1] * (y[2] * z[0] - y[0] * z[2]) +
           x[2] * (y[0] * z[1] - y[1] * z[0]);
}

// Floats of one kind: a coarse grid, where zeros and ties abound, or numbers of a few powers of two.
DVec draw(Random& random, int spread) {
    DVec v;
    for (double& x : v) {
        const double grid = double(int(random() % 4) - 2);
        const double fine = double(float(double(int64_t(random() >> 12)) * 0x1p-52 - 0.5));
        x = spread < 0 ? grid : std::ldexp(fine, int(random() % uint64_t(spread + 1)));
    }
    return v;
}

TEST(Integers, EdgesAreAsRationalsSay) {
    Random random(1);
    int known = 0, zeros = 0;
    for (int i = 0; i < 20000; ++i) {
        const int spread = int(i % 5) - 1;
        const DVec o = draw(random, spread), d = draw(random, spread), b = draw(random, spread), c = draw(random, spread);
        bool touched = false;
        const auto side = integer_edge(o, d, b, c, &touched);
        const Q w = minus(rational(c), rational(b));
        int expected = sgn(determinant(rational(d), minus(rational(c), rational(o)), minus(rational(b), rational(o))));
        const bool zero = expected == 0;
        if (zero) expected = -sgn(mpq_class(d[1] * w[2] - d[2] * w[1]));
        if (expected == 0) expected = -sgn(mpq_class(d[2] * w[0] - d[0] * w[2]));
        if (!side) continue;
        ++known;
        zeros += zero;
        ASSERT_EQ(*side, expected) << i;
        ASSERT_EQ(touched, zero) << i;
    }
    EXPECT_GT(known, 15000);
    EXPECT_GT(zeros, 300);
}

TEST(Integers, DistancesAndTheirOrderAreAsRationalsSay) {
    Random random(2);
    int known = 0, ties = 0;
    for (int i = 0; i < 20000; ++i) {
        const int spread = int(i % 4) - 1;
        const DVec o = draw(random, spread), d = draw(random, spread);
        Ratio t[2];
        mpq_class exact[2];
        bool all = true;
        for (int k = 0; k < 2; ++k) {
            const std::array<DVec, 3> v = {draw(random, spread), draw(random, spread), draw(random, spread)};
            const Q p[3] = {rational(v[0]), rational(v[1]), rational(v[2])};
            const mpq_class below = determinant(rational(d), minus(p[1], p[0]), minus(p[2], p[0]));
            const auto got = integer_t(o, d, v);
            if (sgn(below) == 0) {
                EXPECT_FALSE(got.has_value());
            }
            all = all && got && sgn(below) != 0;
            if (!all) break;
            t[k] = *got;
            exact[k] = determinant(minus(p[0], rational(o)), minus(p[1], rational(o)), minus(p[2], rational(o))) / below;
            ASSERT_NEAR(t[k].value(), exact[k].get_d(), 1e-12 * std::fabs(exact[k].get_d())) << i;
        }
        if (!all) continue;
        ++known;
        const auto order = compare(t[0], t[1]);
        ASSERT_TRUE(order.has_value());
        ASSERT_EQ(*order, cmp(exact[0], exact[1]) > 0 ? 1 : (cmp(exact[0], exact[1]) < 0 ? -1 : 0)) << i;
        ties += *order == 0;
        const double other = double(float(exact[0].get_d()));
        const int against = cmp(exact[0], mpq_class(other));
        ASSERT_EQ(compare(t[0], ratio_of(other)), against > 0 ? 1 : (against < 0 ? -1 : 0)) << i;
    }
    EXPECT_GT(known, 10000);
    EXPECT_GT(ties, 50);
}

TEST(Integers, WhatDoesNotFitIsLeftAlone) {
    bool touched = false;
    EXPECT_FALSE(integer_edge({1e30, 0, 0}, {0, 0, 1}, {1, 0, 0}, {0, 1, 0}, &touched));
    EXPECT_FALSE(integer_t({0, 0, 1e-30}, {0, 0, 1}, {{{0, 0, 1}, {1, 0, 1}, {0, 1, 1}}}));
    EXPECT_FALSE(compare(ratio_of(0x1p200), ratio_of(0x1p-200)));
    EXPECT_EQ(compare(ratio_of(-0x1p200), ratio_of(0x1p-200)), -1);
    EXPECT_EQ(compare(ratio_of(0), ratio_of(-0.0)), 0);
}

}  // namespace
}  // namespace rtc::lab
