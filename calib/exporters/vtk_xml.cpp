#include "calib/exporters/vtk_xml.h"

#include <algorithm>
#include <cstring>

#include "calib/correctors/baked/base64.h"
#include "calib/exporters/bytes.h"
#include "calib/exporters/itk_field.h"

namespace fieldtrue::exporters {
namespace {

std::string base64(const std::string& bytes) {
  return correctors::toBase64({reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()});
}

void appendInt64(std::string& bytes, std::int64_t value) {
  appendInt32(bytes, static_cast<std::int32_t>(static_cast<std::uint64_t>(value) & 0xffffffffU));
  appendInt32(bytes, static_cast<std::int32_t>(static_cast<std::uint64_t>(value) >> 32U));
}

/// An array's data with its length in front, as readers find it.
std::string block(const std::string& bytes) {
  std::string length;
  appendInt64(length, static_cast<std::int64_t>(bytes.size()));
  return base64(length + bytes);
}

tl::unexpected<Error> damaged(const std::string& why) {
  return fail(ErrorCode::kBadInput, "its array cannot be read: " + why);
}

Result<std::string> plainBytes(std::string_view text) {
  auto bytes = correctors::fromBase64(text);
  if (!bytes) return damaged("it is no base64");
  return std::string(bytes->begin(), bytes->end());
}

/// Unsigned number of the header's width.
std::uint64_t headerAt(std::string_view bytes, std::size_t at, std::size_t width) {
  std::uint64_t value = 0;
  for (std::size_t byte = 0; byte < width; ++byte)
    value |= static_cast<std::uint64_t>(static_cast<unsigned char>(bytes[at + byte])) << (8 * byte);
  return value;
}

/// Letters of base64 that hold so many bytes.
std::size_t lettersFor(std::size_t n_bytes) { return (n_bytes + 2) / 3 * 4; }

/// Where an array's raw or encoded data begins, and how it is kept.
struct Data {
  std::string_view from;
  bool is_base64 = true;
  bool is_compressed = false;
  std::size_t header_width = 4;
};

/// So many decoded bytes from the start of what is left, which then begins behind them.
Result<std::string> taken(Data& data, std::size_t n_bytes) {
  const std::size_t letters = data.is_base64 ? lettersFor(n_bytes) : n_bytes;
  if (letters > data.from.size()) return damaged("it ends too early");
  const std::string_view some = data.from.substr(0, letters);
  data.from.remove_prefix(letters);
  return data.is_base64 ? plainBytes(some) : Result<std::string>(std::string(some));
}

Result<std::string> plainArray(Data data) {
  const std::size_t width = data.header_width;
  Data ahead = data;
  // The length is encoded together with what follows it, so it is looked at first.
  FT_TRY(const auto head, taken(ahead, width));
  const std::uint64_t n_bytes = headerAt(head, 0, width);
  if (n_bytes > data.from.size()) return damaged("it ends too early");
  FT_TRY(const auto all, taken(data, width + n_bytes));
  return all.substr(width);
}

Result<std::string> compressedArray(Data data) {
  const std::size_t width = data.header_width;
  Data ahead = data;
  FT_TRY(const auto count, taken(ahead, width));
  const std::uint64_t n_blocks = headerAt(count, 0, width);
  if (n_blocks > data.from.size()) return damaged("it ends too early");
  FT_TRY(const auto head, taken(data, (3 + n_blocks) * width));
  std::uint64_t n_bytes = 0;
  for (std::size_t i = 0; i < n_blocks; ++i) n_bytes += headerAt(head, (3 + i) * width, width);
  if (n_bytes > data.from.size()) return damaged("it ends too early");
  FT_TRY(const auto packed, taken(data, n_bytes));
  std::string all;
  std::size_t at = 0;
  for (std::size_t i = 0; i < n_blocks; ++i) {
    const std::uint64_t size = headerAt(head, (3 + i) * width, width);
    const auto plain = inflated(std::string_view(packed).substr(at, size));
    if (!plain) return damaged(plain.error().message);
    all += *plain;
    at += size;
  }
  return all;
}

std::string_view trimmedText(std::string_view text) {
  const std::size_t from = text.find_first_not_of(" \t\r\n");
  if (from == std::string_view::npos) return {};
  return text.substr(from, text.find_last_not_of(" \t\r\n") - from + 1);
}

}  // namespace

std::string vtkHead(const std::string& type, const Facts& facts) {
  std::string about = factLines(facts, "");
  // Two dashes would end the comment.
  for (std::size_t at = about.find("--"); at != std::string::npos; at = about.find("--", at)) about.replace(at, 2, "-");
  return "<?xml version=\"1.0\"?>\n<!--\n" + about + "-->\n<VTKFile type=\"" + type +
         "\" version=\"1.0\" byte_order=\"LittleEndian\" header_type=\"UInt64\">\n";
}

std::string vtkArray(const std::string& name, int components, const std::vector<double>& numbers) {
  std::string bytes;
  bytes.reserve(8 * numbers.size());
  for (const double number : numbers) appendDouble(bytes, number);
  return "<DataArray type=\"Float64\" Name=\"" + name + "\" NumberOfComponents=\"" + std::to_string(components) +
         "\" format=\"binary\">\n" + block(bytes) + "\n</DataArray>\n";
}

std::string vtkArray(const std::string& name, const std::vector<Eigen::Vector3d>& vectors) {
  std::vector<double> numbers;
  numbers.reserve(3 * vectors.size());
  for (const Eigen::Vector3d& v : vectors) numbers.insert(numbers.end(), v.begin(), v.end());
  return vtkArray(name, 3, numbers);
}

std::string vtkIntegers(const std::string& name, const std::vector<std::int64_t>& numbers) {
  std::string bytes;
  for (const std::int64_t number : numbers) appendInt64(bytes, number);
  return "<DataArray type=\"Int64\" Name=\"" + name + "\" format=\"binary\">\n" + block(bytes) + "\n</DataArray>\n";
}

Result<std::vector<double>> vtkNumbers(const pugi::xml_node& root, const pugi::xml_node& array) {
  const std::string format = array.attribute("format").as_string("ascii");
  if (format == "ascii") return numbersIn(array.child_value());
  if (std::string(root.attribute("byte_order").as_string("LittleEndian")) != "LittleEndian")
    return damaged("its numbers are big-endian");
  Data data;
  const std::string compressor = root.attribute("compressor").as_string();
  if (!compressor.empty() && compressor != "vtkZLibDataCompressor") return damaged("it is packed by " + compressor);
  data.is_compressed = !compressor.empty();
  data.header_width = std::string(root.attribute("header_type").as_string("UInt32")) == "UInt64" ? 8 : 4;
  data.from = trimmedText(array.child_value());
  if (format == "appended") {
    const pugi::xml_node appended = root.child("AppendedData");
    if (std::string(appended.attribute("encoding").as_string()) != "base64")
      return damaged("its appended data is raw, which is no XML; write it inline or in base64");
    data.from = trimmedText(appended.child_value());
    const std::size_t offset = 1 + array.attribute("offset").as_ullong();  // Behind the underscore.
    if (offset > data.from.size()) return damaged("its offset lies behind the end");
    data.from.remove_prefix(offset);
  }
  FT_TRY(const auto bytes, data.is_compressed ? compressedArray(data) : plainArray(data));
  const std::string type = array.attribute("type").as_string();
  std::vector<double> numbers;
  if (type == "Float64") {
    for (std::size_t at = 0; at + 8 <= bytes.size(); at += 8) numbers.push_back(doubleAt(bytes, at));
  } else if (type == "Float32") {
    for (std::size_t at = 0; at + 4 <= bytes.size(); at += 4)
      numbers.push_back(static_cast<double>(floatAt(bytes, at)));
  } else {
    return damaged("its type is '" + type + "', neither Float64 nor Float32");
  }
  return numbers;
}

}  // namespace fieldtrue::exporters
