#pragma once

#include <cstddef>
#include <functional>
#include <string>

namespace blind {

/// Does something for each of the numbers 0 to count - 1, several at once. After the first failure nothing new is
/// begun.
/// @param name_of what a failure is called by
/// @error std::runtime_error "NAME: what went wrong" of one that failed
void sideBySide(std::size_t jobs, std::size_t count, const std::function<std::string(std::size_t)>& name_of,
                const std::function<void(std::size_t)>& work);

}  // namespace blind
