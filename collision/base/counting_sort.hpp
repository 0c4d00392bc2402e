#pragma once

#include <cstddef>
#include <numeric>
#include <vector>

namespace nbd {

/// Orders items by a key in linear time; those of one key keep their order.
class CountingSort {
 public:
    /// items: replaced by the ordered ones. key(item): 0 .. keys - 1. ordered: scratch memory.
    template <class Item, class Key>
    void sort(std::vector<Item>& items, int keys, const Key& key, std::vector<Item>& ordered) {
        begin_.assign(static_cast<std::size_t>(keys) + 1, 0);
        for (const Item& item : items) ++begin_[static_cast<std::size_t>(key(item)) + 1];
        std::partial_sum(begin_.begin(), begin_.end(), begin_.begin());
        ordered.resize(items.size());
        for (const Item& item : items) ordered[begin_[static_cast<std::size_t>(key(item))]++] = item;
        items.swap(ordered);
    }

 private:
    std::vector<std::size_t> begin_;
};

}  // namespace nbd
