#pragma once

#include <cstddef>

namespace fieldtrue::correctors {

/// A^T B, where A has six columns and B a thousand or more: B is read once, where a general product first copies it.
/// @param six A, six contiguous columns of `rows`
/// @param wide B, `count` contiguous columns of `rows`
/// @param products 6 by `count`, by columns; out
void sixColumnsTimes(const double* six, const double* wide, std::size_t rows, std::size_t count, double* products);

}  // namespace fieldtrue::correctors
