// Operand words of an instruction: std::vector's interface over storage that is
// part of the instruction itself up to six words, which nearly all need. A module
// is copied and rewritten many times on its way; this keeps the allocator out of it.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <initializer_list>
#include <iterator>
#include <utility>
#include <vector>

namespace rtc::ir {

class Words {
  public:
    using value_type = uint32_t;
    using size_type = size_t;
    using difference_type = ptrdiff_t;
    using reference = uint32_t&;
    using const_reference = const uint32_t&;
    using iterator = uint32_t*;
    using const_iterator = const uint32_t*;

    Words() = default;
    Words(std::initializer_list<uint32_t> words) { assign(words.begin(), words.end()); }
    Words(const std::vector<uint32_t>& words) { assign(words.begin(), words.end()); }
    template <std::forward_iterator It>
    Words(It first, It last) {
        assign(first, last);
    }
    Words(const Words& other) {
        if (other.is_inline()) {
            size_ = other.size_;
            std::memcpy(inline_, other.inline_, sizeof inline_);
        } else {
            assign(other.begin(), other.end());
        }
    }
    Words(Words&& other) noexcept { take(other); }
    ~Words() { release(); }

    Words& operator=(const Words& other) {
        if (this != &other) assign(other.begin(), other.end());
        return *this;
    }
    Words& operator=(Words&& other) noexcept {
        if (this != &other) {
            release();
            take(other);
        }
        return *this;
    }
    Words& operator=(std::initializer_list<uint32_t> words) {
        assign(words.begin(), words.end());
        return *this;
    }

    size_t size() const { return size_; }
    bool empty() const { return size_ == 0; }
    uint32_t* data() { return is_inline() ? inline_ : heap_; }
    const uint32_t* data() const { return is_inline() ? inline_ : heap_; }
    uint32_t* begin() { return data(); }
    uint32_t* end() { return data() + size_; }
    const uint32_t* begin() const { return data(); }
    const uint32_t* end() const { return data() + size_; }
    uint32_t& operator[](size_t i) { return data()[i]; }
    const uint32_t& operator[](size_t i) const { return data()[i]; }
    uint32_t& front() { return data()[0]; }
    uint32_t& back() { return data()[size_ - 1]; }
    const uint32_t& front() const { return data()[0]; }
    const uint32_t& back() const { return data()[size_ - 1]; }

    void clear() { size_ = 0; }
    void reserve(size_t capacity) {
        if (capacity > capacity_) grow(capacity);
    }
    void resize(size_t size, uint32_t fill = 0) {
        reserve(size);
        if (size > size_) std::fill(data() + size_, data() + size, fill);
        size_ = static_cast<uint32_t>(size);
    }
    void push_back(uint32_t word) {
        if (size_ == capacity_) grow(2 * static_cast<size_t>(capacity_));
        data()[size_++] = word;
    }
    void pop_back() { --size_; }
    template <std::forward_iterator It>
    void assign(It first, It last) {
        const size_t count = static_cast<size_t>(std::distance(first, last));
        reserve(count);
        std::copy(first, last, data());
        size_ = static_cast<uint32_t>(count);
    }
    // The range must not lie in this object.
    template <std::forward_iterator It>
    uint32_t* insert(const uint32_t* place, It first, It last) {
        const size_t at = static_cast<size_t>(place - data()), count = static_cast<size_t>(std::distance(first, last));
        reserve(size_ + count);
        uint32_t* const words = data();
        std::copy_backward(words + at, words + size_, words + size_ + count);
        std::copy(first, last, words + at);
        size_ += static_cast<uint32_t>(count);
        return words + at;
    }
    uint32_t* insert(const uint32_t* place, uint32_t word) { return insert(place, &word, &word + 1); }
    uint32_t* erase(const uint32_t* first, const uint32_t* last) {
        uint32_t* const to = data() + (first - data());
        std::copy(const_cast<uint32_t*>(last), end(), to);
        size_ -= static_cast<uint32_t>(last - first);
        return to;
    }
    uint32_t* erase(const uint32_t* place) { return erase(place, place + 1); }

    friend bool operator==(const Words& a, const Words& b) {
        return a.size_ == b.size_ && std::equal(a.begin(), a.end(), b.begin());
    }
    operator std::vector<uint32_t>() const { return {begin(), end()}; }

  private:
    static constexpr uint32_t kInline = 6;

    bool is_inline() const { return capacity_ == kInline; }
    void release() {
        if (!is_inline()) delete[] heap_;
    }
    void take(Words& other) {
        size_ = other.size_;
        capacity_ = other.capacity_;
        std::memcpy(inline_, other.inline_, sizeof inline_);  // the words, or the pointer to them
        other.size_ = 0;
        other.capacity_ = kInline;
    }
    void grow(size_t capacity) {
        capacity = std::max<size_t>(capacity, 2 * kInline);
        uint32_t* const words = new uint32_t[capacity];
        std::copy(begin(), end(), words);
        release();
        heap_ = words;
        capacity_ = static_cast<uint32_t>(capacity);
    }

    uint32_t size_ = 0;
    uint32_t capacity_ = kInline;
    union {
        uint32_t inline_[kInline] = {};
        uint32_t* heap_;
    };
};

}  // namespace rtc::ir
