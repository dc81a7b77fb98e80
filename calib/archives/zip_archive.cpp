#include "calib/archives/zip_archive.h"

#include <zip.h>

#include <memory>

#include "calib/core/file_io.h"

namespace fieldtrue {
namespace {

struct DiscardZip {
  void operator()(zip_t* archive) const { zip_discard(archive); }
};
using OpenZip = std::unique_ptr<zip_t, DiscardZip>;

bool addMember(zip_t* archive, const ZipMember& member) {
  zip_source_t* source = zip_source_buffer(archive, member.content.data(), member.content.size(), 0);
  const zip_int64_t at = source == nullptr ? -1 : zip_file_add(archive, member.name.c_str(), source, ZIP_FL_ENC_UTF_8);
  if (at < 0) {
    if (source != nullptr) zip_source_free(source);
    return false;
  }
  // A time of their own would make every file another one.
  constexpr zip_uint16_t kNoon = 0x6000, kFirstOf1980 = 0x0021;
  const auto index = static_cast<zip_uint64_t>(at);
  return zip_set_file_compression(archive, index, member.packed ? ZIP_CM_DEFLATE : ZIP_CM_STORE, 0) == 0 &&
         zip_file_set_dostime(archive, index, kNoon, kFirstOf1980, 0) == 0;
}

bool fillZip(const std::filesystem::path& path, const std::vector<ZipMember>& members) {
  int status = 0;
  OpenZip archive(zip_open(path.c_str(), ZIP_CREATE | ZIP_TRUNCATE, &status));
  if (!archive) return false;
  for (const ZipMember& member : members)
    if (!addMember(archive.get(), member)) return false;
  if (zip_close(archive.get()) != 0) return false;
  (void)archive.release();  // Closing freed it.
  return true;
}

std::string reasonOf(int status) {
  zip_error_t error;
  zip_error_init_with_code(&error, status);
  std::string reason = zip_error_strerror(&error);
  zip_error_fini(&error);
  return reason;
}

/// @error kBadInput with the reason alone
Result<std::string> contentOf(zip_t* archive, zip_uint64_t index, zip_uint64_t bytes) {
  std::unique_ptr<zip_file_t, int (*)(zip_file_t*)> file(zip_fopen_index(archive, index, 0), zip_fclose);
  if (!file) return fail(ErrorCode::kBadInput, zip_strerror(archive));
  std::string content(bytes, '\0');
  const zip_int64_t read = zip_fread(file.get(), content.data(), content.size());
  // Beyond the end: only then is the check sum tested.
  char beyond = 0;
  const zip_int64_t more = read < 0 ? read : zip_fread(file.get(), &beyond, 1);
  if (more < 0) return fail(ErrorCode::kBadInput, zip_file_strerror(file.get()));
  if (read != static_cast<zip_int64_t>(bytes) || more != 0) return fail(ErrorCode::kBadInput, "it has another length");
  return content;
}

tl::unexpected<Error> noArchive(const std::filesystem::path& path, const std::string& why) {
  return fail(ErrorCode::kBadInput, path.string() + " cannot be read as a zip archive: " + why);
}

}  // namespace

Result<void> writeZip(const std::filesystem::path& path, const std::vector<ZipMember>& members) {
  return replaceFileAtomically(path, [&](const std::filesystem::path& beside) -> Result<void> {
    if (fillZip(beside, members)) return {};
    return fail(ErrorCode::kIo,
                "Cannot write " + path.string() + ": the archive could not be stored; is the disk full?");
  });
}

Result<std::map<std::string, std::string>> readZip(const std::filesystem::path& path, std::uint64_t most_bytes) {
  // The system's reason is the better one.
  if (const auto opened = openForReading(path); !opened) return tl::unexpected(opened.error());
  int status = 0;
  const OpenZip archive(zip_open(path.c_str(), ZIP_RDONLY, &status));
  if (!archive) return noArchive(path, reasonOf(status));
  std::map<std::string, std::string> members;
  std::uint64_t bytes = 0;
  for (zip_int64_t index = 0; index < zip_get_num_entries(archive.get(), 0); ++index) {
    zip_stat_t about;
    const auto at = static_cast<zip_uint64_t>(index);
    if (zip_stat_index(archive.get(), at, 0, &about) != 0) return noArchive(path, zip_strerror(archive.get()));
    if (about.size > most_bytes - bytes) {
      return noArchive(path, "unpacked it holds more than " + std::to_string(most_bytes) + " bytes");
    }
    bytes += about.size;
    auto content = contentOf(archive.get(), at, about.size);
    if (!content)
      return noArchive(path, std::string(about.name) + " in it is damaged (" + content.error().message + ")");
    members[about.name] = *std::move(content);
  }
  return members;
}

}  // namespace fieldtrue
