#pragma once

#include <stdexcept>
#include <string>
#include <tl/expected.hpp>
#include <utility>

namespace fieldtrue {

/// What kind of thing went wrong; the message says exactly what.
enum class ErrorCode {
  kBadInput,      ///< A file, argument or setting does not say what it must.
  kIo,            ///< Reading or writing failed (missing file, full disk, permissions).
  kTooFewNodes,   ///< The method needs more nodes than there are.
  kDegenerate,    ///< The nodes are there but do not determine the answer (coplanar, repeated).
  kUnsupported,   ///< The request is meaningful but cannot be done with this data or build.
  kDevice,        ///< The tracker or its line does not answer as it should.
  kNewerVersion,  ///< The file was written by a newer version of the program.
  kCancelled,     ///< The caller asked to stop.
};

/// A bad-data or bad-device error: one sentence that says what was seen and what is needed.
struct Error {
  ErrorCode code = ErrorCode::kBadInput;
  std::string message;
};

template <class T>
using Result = tl::expected<T, Error>;

/// Shorthand for returning an error from a function whose return type is Result<T>.
inline tl::unexpected<Error> fail(ErrorCode code, std::string message) {
  return tl::unexpected<Error>(Error{code, std::move(message)});
}

/// @error std::logic_error always; reached only through FT_CHECK.
[[noreturn]] inline void checkFailed(const char* condition, const char* file, int line) {
  throw std::logic_error(std::string("check failed: ") + condition + " (" + file + ":" + std::to_string(line) + ")");
}

}  // namespace fieldtrue

/// A programmer's mistake: throws std::logic_error. Never used for data or devices.
#define FT_CHECK(condition) \
  ((condition) ? static_cast<void>(0) : ::fieldtrue::checkFailed(#condition, __FILE__, __LINE__))

#define FT_JOIN_TEXT(a, b) a##b
#define FT_JOIN(a, b) FT_JOIN_TEXT(a, b)

/// Declares what a Result holds, or returns its error: FT_TRY(const auto table, readTable(path));
#define FT_TRY(declaration, ...)                                                                 \
  auto FT_JOIN(ft_result_, __LINE__) = __VA_ARGS__;                                              \
  if (!FT_JOIN(ft_result_, __LINE__))                                                            \
    return tl::unexpected<::fieldtrue::Error>(std::move(FT_JOIN(ft_result_, __LINE__)).error()); \
  declaration = *std::move(FT_JOIN(ft_result_, __LINE__))

/// Returns the error of a Result whose value, if any, is not wanted.
#define FT_TRY_VOID(...)                                                                                             \
  do {                                                                                                               \
    if (auto ft_done = __VA_ARGS__; !ft_done) return tl::unexpected<::fieldtrue::Error>(std::move(ft_done).error()); \
  } while (false)
