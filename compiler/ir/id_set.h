// Sets of ids and maps from ids. Ids are small dense numbers, so tables beat trees
// and hashes; both grow as needed.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace rtc::ir {

class IdSet {
  public:
    IdSet() = default;
    // True when the id was not in the set.
    bool insert(uint32_t id) {
        const size_t word = id >> 6;
        if (word >= bits_.size()) bits_.resize(word + word / 2 + 8, 0);
        const uint64_t bit = uint64_t{1} << (id & 63);
        const bool fresh = !(bits_[word] & bit);
        bits_[word] |= bit;
        return fresh;
    }
    bool contains(uint32_t id) const {
        const size_t word = id >> 6;
        return word < bits_.size() && (bits_[word] >> (id & 63) & 1);
    }
    size_t count(uint32_t id) const { return contains(id); }
    void erase(uint32_t id) {
        if (contains(id)) bits_[id >> 6] &= ~(uint64_t{1} << (id & 63));
    }

    void reserve(uint32_t bound) {
        if (bits_.size() < bound / 64 + 1) bits_.resize(bound / 64 + 1, 0);
    }

  private:
    std::vector<uint64_t> bits_;
};

// Absent ids give T{}: for values of which that is none.
template <typename T>
class IdMap {
  public:
    T& operator[](uint32_t id) {
        if (id >= values_.size()) values_.resize(id + id / 2 + 64);
        return values_[id];
    }
    const T& get(uint32_t id) const {
        static const T none{};
        return id < values_.size() ? values_[id] : none;
    }
    void clear() { values_.clear(); }
    // Room for ids below `bound`, made at once.
    void reserve(uint32_t bound) {
        if (values_.size() < bound) values_.resize(bound);
    }

  private:
    std::vector<T> values_;
};

}  // namespace rtc::ir
