// The mutator of both fuzz targets: it changes instructions instead of bytes, so that most inputs get past the
// header. An input is a byte of choices and a module's words behind it.
#include <algorithm>
#include <cstring>
#include <random>

#include "fuzz_words.h"

extern "C" size_t LLVMFuzzerMutate(uint8_t* data, size_t size, size_t max_size);

namespace rtc::fuzz {

Words words_of(const uint8_t* data, size_t size) {
    Words words(size ? (size - 1) / 4 : 0);
    if (!words.empty()) std::memcpy(words.data(), data + 1, words.size() * 4);
    return words;
}

namespace {

// Where instructions begin; the rest of a damaged stream counts as one.
std::vector<size_t> starts_of(const Words& words) {
    std::vector<size_t> starts;
    for (size_t at = 5; at < words.size();) {
        starts.push_back(at);
        const size_t count = words[at] >> 16;
        if (!count || at + count > words.size()) break;
        at += count;
    }
    return starts;
}

size_t end_of(const Words& words, size_t at) { return std::min(words.size(), at + std::max(1u, words[at] >> 16)); }

void set_count(uint32_t& head, size_t count) { head = (head & 0xffff) | uint32_t(count) << 16; }

void mutate(Words& words, const Words& other, std::minstd_rand& random) {
    const auto below = [&](size_t n) { return n ? size_t(random()) % n : 0; };
    const std::vector<size_t> starts = starts_of(words);
    if (starts.empty()) return;
    const size_t at = starts[below(starts.size())], end = end_of(words, at), count = end - at;
    const auto begin = words.begin();
    using Offset = Words::difference_type;
    switch (below(12)) {
        case 0: words.erase(begin + Offset(at), begin + Offset(end)); break;
        case 1: {  // the same instruction again, somewhere
            const Words copy(begin + Offset(at), begin + Offset(end));
            words.insert(begin + Offset(starts[below(starts.size())]), copy.begin(), copy.end());
            break;
        }
        case 2: {  // an instruction, or a run of them, of another module
            const std::vector<size_t> theirs = starts_of(other);
            if (theirs.empty()) break;
            const size_t first = below(theirs.size()), last = std::min(theirs.size() - 1, first + below(8));
            words.insert(begin + Offset(at), other.begin() + Offset(theirs[first]),
                         other.begin() + Offset(end_of(other, theirs[last])));
            break;
        }
        case 3: words[at] = (words[at] & 0xffff0000u) | uint32_t(below(below(4) ? 450 : 6200)); break;
        case 4: set_count(words[at], below(4) ? count + below(3) - 1 : below(0x10000)); break;
        case 5: {  // one operand more, with the count told
            words.insert(begin + Offset(at + 1 + below(count)), uint32_t(below(words[3] + 2u)));
            set_count(words[at], count + 1);
            break;
        }
        case 6:  // one fewer
            if (count < 2) break;
            words.erase(begin + Offset(at + 1 + below(count - 1)));
            set_count(words[at], count - 1);
            break;
        case 7:
        case 8: {  // an operand: an id near the bound, a small number, a flipped bit
            if (count < 2) break;
            uint32_t& word = words[at + 1 + below(count - 1)];
            switch (below(5)) {
                case 0: word = uint32_t(below(words[3] + 2u)); break;
                case 1: word = uint32_t(below(70)); break;
                case 2: word ^= 1u << below(32); break;
                case 3: word = words[3] - uint32_t(below(3)); break;
                default: word = below(2) ? 0xffffffffu : 0u;
            }
            break;
        }
        case 9: {  // two instructions change places
            const size_t there = starts[below(starts.size())];
            const Words a(begin + Offset(at), begin + Offset(end));
            const Words b(begin + Offset(there), begin + Offset(end_of(words, there)));
            if (a.size() == b.size()) {
                std::copy(b.begin(), b.end(), begin + Offset(at));
                std::copy(a.begin(), a.end(), begin + Offset(there));
            } else {
                words.erase(begin + Offset(at), begin + Offset(end));
                words.insert(words.begin() + Offset(std::min(words.size(), there)), a.begin(), a.end());
            }
            break;
        }
        case 10: words.resize(5 + below(words.size() - 4)); break;
        default: {  // the header, or the other byte order
            const size_t field = below(6);
            if (field < 5)
                words[field] = field == 1 ? uint32_t(below(8)) << 8 | 0x10000u
                               : field == 3 ? uint32_t(below(4) ? below(words.size()) : random())
                                            : words[field] ^ 1u << below(32);
            else
                for (uint32_t& w : words) w = w >> 24 | (w >> 8 & 0xff00) | (w << 8 & 0xff0000) | w << 24;
        }
    }
}

size_t store(const Words& words, uint8_t* data, size_t max_size) {
    const size_t count = std::min(words.size(), (max_size - 1) / 4);
    std::memcpy(data + 1, words.data(), count * 4);
    return 1 + count * 4;
}

}  // namespace
}  // namespace rtc::fuzz

using rtc::fuzz::Words, rtc::fuzz::words_of;

extern "C" size_t LLVMFuzzerCustomMutator(uint8_t* data, size_t size, size_t max_size, unsigned seed) {
    std::minstd_rand random(seed);
    Words words = words_of(data, size);
    if (words.size() < 6 || max_size < 32 || random() % 8 == 0) return LLVMFuzzerMutate(data, size, max_size);
    const Words itself = words;
    for (unsigned n = 1 + random() % 4; n && words.size() > 5; --n) rtc::fuzz::mutate(words, itself, random);
    return rtc::fuzz::store(words, data, max_size);
}

extern "C" size_t LLVMFuzzerCustomCrossOver(const uint8_t* data1, size_t size1, const uint8_t* data2, size_t size2,
                                            uint8_t* out, size_t max_size, unsigned seed) {
    std::minstd_rand random(seed);
    Words words = words_of(data1, size1);
    const Words other = words_of(data2, size2);
    if (max_size < 32 || words.size() < 6) {
        const size_t size = std::min(size1, max_size);
        if (size) std::memcpy(out, data1, size);
        return size;
    }
    out[0] = data1[0];
    for (unsigned n = 1 + random() % 3; n && words.size() > 5; --n) rtc::fuzz::mutate(words, other, random);
    return rtc::fuzz::store(words, out, max_size);
}
