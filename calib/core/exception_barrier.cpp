#include "calib/core/exception_barrier.h"

#include <new>
#include <stdexcept>
#include <string_view>

namespace fieldtrue {
namespace {

/// What FT_CHECK threw, without its own first words and without the folder the program was built in.
std::string checkText(std::string text) {
  constexpr std::string_view kFirst = "check failed: ";
  if (text.starts_with(kFirst)) text.erase(0, kFirst.size());
  const std::size_t open = text.rfind(" (");
  const std::size_t slash = text.rfind('/');
  if (open != std::string::npos && slash != std::string::npos && slash > open) text.erase(open + 2, slash - open - 1);
  return text;
}

std::string notEnoughMemory(const std::string& what_stands) {
  return "There is not enough memory for this; " + what_stands + ". Use fewer places, or close other programs";
}

}  // namespace

std::string thrownText(const std::string& what_stands) {
  try {
    throw;
  } catch (const std::bad_alloc&) {
    return notEnoughMemory(what_stands);
  } catch (const std::length_error&) {
    return notEnoughMemory(what_stands);
  } catch (const std::logic_error& error) {
    return "An internal check failed: " + checkText(error.what()) + "; " + what_stands +
           ". This is a fault of the program: please report it";
  } catch (const std::exception& error) {
    return "Something unforeseen failed: " + std::string(error.what()) + "; " + what_stands;
  } catch (...) {
    return "Something unforeseen failed and did not say what; " + what_stands;
  }
}

Error thrownError(const std::string& what_stands) { return {ErrorCode::kUnsupported, thrownText(what_stands)}; }

}  // namespace fieldtrue
