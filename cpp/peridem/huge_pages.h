// Large arrays in pages of 2 MB where the system has them: fewer misses of the page tables.
#pragma once

#include <cstddef>
#include <vector>

namespace peridem {

inline constexpr std::size_t huge_page = std::size_t{1} << 21;

// A wish for the whole huge pages within [begin, begin + bytes), not touched yet; may go unheard.
void wishForHugePages(void* begin, std::size_t bytes);

template <class T>
std::vector<T> arrayInHugePages(std::size_t n, const T& value) {
  std::vector<T> array;
  array.reserve(n);
  wishForHugePages(array.data(), n * sizeof(T));
  array.assign(n, value);
  return array;
}

}  // namespace peridem
