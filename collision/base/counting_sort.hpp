#pragma once

#include <cstddef>
#include <numeric>
#include <vector>

namespace nbd {

/// Orders items by a key in linear time; those of one key keep their order. Owns its scratch memory.
template <class Item>
class CountingSort {
 public:
    /// Makes room for so many items and keys.
    void reserve(std::size_t items, int keys) {
        begin_.reserve(static_cast<std::size_t>(keys) + 1);
        ordered_.reserve(items);
    }

    /// items: replaced by the ordered ones. key(item): 0 .. keys - 1.
    template <class Key>
    void sort(std::vector<Item>& items, int keys, const Key& key) {
        begin_.assign(static_cast<std::size_t>(keys) + 1, 0);
        for (const Item& item : items) ++begin_[static_cast<std::size_t>(key(item)) + 1];
        std::partial_sum(begin_.begin(), begin_.end(), begin_.begin());
        ordered_.resize(items.size());
        for (const Item& item : items) ordered_[begin_[key(item)]++] = item;
        items.swap(ordered_);
    }

 private:
    std::vector<std::size_t> begin_;
    std::vector<Item> ordered_;
};

}  // namespace nbd
