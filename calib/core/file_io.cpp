#include "calib/core/file_io.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cctype>
#include <cerrno>
#include <charconv>
#include <cmath>
#include <csignal>
#include <cstring>
#include <streambuf>
#include <string_view>
#include <system_error>

namespace fieldtrue {

namespace {

std::string reasonText(int error_number) { return std::generic_category().message(error_number); }

/// A stream buffer over a file descriptor that keeps the system's reason of its first failure.
class DescriptorBuffer : public std::streambuf {
 public:
  explicit DescriptorBuffer(int descriptor) : descriptor_(descriptor) {
    setp(bytes_.data(), bytes_.data() + bytes_.size());
  }
  int errorNumber() const { return error_number_; }

 protected:
  int_type overflow(int_type next) override {
    if (!flush()) return traits_type::eof();
    if (!traits_type::eq_int_type(next, traits_type::eof())) sputc(traits_type::to_char_type(next));
    return traits_type::not_eof(next);
  }
  int sync() override { return flush() ? 0 : -1; }

 private:
  bool flush() {
    const char* from = pbase();
    while (error_number_ == 0 && from < pptr()) {
      const ssize_t written = ::write(descriptor_, from, static_cast<std::size_t>(pptr() - from));
      if (written >= 0) {
        from += written;
      } else if (errno != EINTR) {
        error_number_ = errno;
      }
    }
    setp(bytes_.data(), bytes_.data() + bytes_.size());
    return error_number_ == 0;
  }

  int descriptor_;
  int error_number_ = 0;
  std::array<char, 65536> bytes_;
};

class Descriptor {
 public:
  Descriptor(const std::filesystem::path& path, int flags) : value_(::open(path.c_str(), flags | O_CLOEXEC, 0666)) {}
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  ~Descriptor() { close(); }
  int value() const { return value_; }
  bool valid() const { return value_ >= 0; }
  int close() {
    const int status = valid() ? ::close(value_) : 0;
    value_ = -1;
    return status;
  }

 private:
  int value_;
};

/// Deletes the file beside the target unless it has been renamed over it.
class TemporaryFile {
 public:
  explicit TemporaryFile(const std::filesystem::path& target) {
    static std::atomic<unsigned> counter{0};
    path_ = target;
    path_ += ".part-" + std::to_string(::getpid()) + "-" + std::to_string(counter++);
  }
  TemporaryFile(const TemporaryFile&) = delete;
  TemporaryFile& operator=(const TemporaryFile&) = delete;
  ~TemporaryFile() {
    if (!renamed_) ::unlink(path_.c_str());
  }
  const std::filesystem::path& path() const { return path_; }
  bool renameOver(const std::filesystem::path& target) {
    renamed_ = ::rename(path_.c_str(), target.c_str()) == 0;
    return renamed_;
  }

 private:
  std::filesystem::path path_;
  bool renamed_ = false;
};

tl::unexpected<Error> cannotWrite(const std::filesystem::path& path, const std::string& reason) {
  std::error_code ignored;
  const bool had_file = std::filesystem::is_regular_file(path, ignored);
  return fail(ErrorCode::kIo, "Cannot write " + path.string() + ": " + reason +
                                  (had_file ? " (the file that was there is unchanged)" : ""));
}

/// Lets the caller fill the file and pushes it to the disk. @return 0 or the system's error number
int fillAndSync(int descriptor, const std::function<void(std::ostream&)>& write, bool sync) {
  DescriptorBuffer buffer(descriptor);
  std::ostream out(&buffer);
  write(out);
  out.flush();
  if (buffer.errorNumber() != 0) return buffer.errorNumber();
  if (!out) return EIO;
  if (sync && ::fsync(descriptor) != 0) return errno;
  return 0;
}

/// A rename is on the disk only when its folder is.
void syncFolder(const std::filesystem::path& folder) {
  const Descriptor descriptor(folder, O_RDONLY | O_DIRECTORY);
  if (descriptor.valid()) ::fsync(descriptor.value());
}

/// Devices and pipes cannot be replaced by a rename: they are written as they are.
Result<void> writeThrough(const std::filesystem::path& path, const std::function<void(std::ostream&)>& write) {
  Descriptor descriptor(path, O_WRONLY);
  if (!descriptor.valid()) return cannotWrite(path, reasonText(errno));
  const int error_number = fillAndSync(descriptor.value(), write, false);
  if (error_number != 0) return cannotWrite(path, reasonText(error_number));
  return {};
}

/// Whether a session goes by that name: it, or what SQLite keeps beside it while it is open.
bool isNamedSession(const std::filesystem::path& path) {
  std::string extension = path.extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char letter) { return static_cast<char>(std::tolower(letter)); });
  return extension == ".fieldtrue" || extension == ".fieldtrue-wal" || extension == ".fieldtrue-shm";
}

/// A session is not even opened to be read: closing the descriptor would drop the locks that this program may have on
/// it.
Result<void> refuseSession(const std::filesystem::path& path) {
  std::error_code ignored;
  if (!std::filesystem::is_regular_file(path, ignored)) return {};
  if (!isNamedSession(path) && !isNamedSession(std::filesystem::weakly_canonical(path, ignored))) return {};
  return fail(ErrorCode::kBadInput,
              "Cannot read " + path.string() + ": it is a session; open it, or use fieldtrue-cli tables --session");
}

/// Whether a session stands there: a day's work, held in a database that a program may have open. By its name first,
/// for closing a descriptor of a session that this program has open would drop the locks on it.
bool isSession(const std::filesystem::path& target) {
  if (isNamedSession(target)) return true;
  constexpr std::string_view kDatabase("SQLite format 3\0", 16);
  const Descriptor descriptor(target, O_RDONLY);
  std::array<char, kDatabase.size()> head{};
  return descriptor.valid() && ::read(descriptor.value(), head.data(), head.size()) == ssize_t{kDatabase.size()} &&
         std::string_view(head.data(), head.size()) == kDatabase;
}

Result<void> writeAndRename(const std::filesystem::path& path, const std::filesystem::path& target,
                            const std::function<void(std::ostream&)>& write) {
  struct stat old_file {};
  const bool has_old = ::stat(target.c_str(), &old_file) == 0;
  if (has_old && ::access(target.c_str(), W_OK) != 0) return cannotWrite(path, reasonText(errno));
  if (has_old && isSession(target)) return cannotWrite(path, "it is a session; choose another name");
  TemporaryFile temporary(target);
  Descriptor descriptor(temporary.path(), O_WRONLY | O_CREAT | O_EXCL);
  if (!descriptor.valid()) return cannotWrite(path, reasonText(errno));
  if (has_old && ::fchmod(descriptor.value(), old_file.st_mode & 07777) != 0)
    return cannotWrite(path, reasonText(errno));
  const int error_number = fillAndSync(descriptor.value(), write, true);
  if (error_number != 0) return cannotWrite(path, reasonText(error_number));
  if (descriptor.close() != 0) return cannotWrite(path, reasonText(errno));
  if (!temporary.renameOver(target)) return cannotWrite(path, reasonText(errno));
  syncFolder(target.has_parent_path() ? target.parent_path() : std::filesystem::path("."));
  return {};
}

}  // namespace

Result<std::string> readFile(const std::filesystem::path& path) {
  const auto cannotRead = [&](int error_number) {
    return fail(ErrorCode::kIo, "Cannot read " + path.string() + ": " + reasonText(error_number));
  };
  FT_TRY_VOID(refuseSession(path));
  const Descriptor descriptor(path, O_RDONLY);
  if (!descriptor.valid()) return cannotRead(errno);
  std::string content;
  std::array<char, 65536> bytes;
  while (true) {
    const ssize_t count = ::read(descriptor.value(), bytes.data(), bytes.size());
    if (count == 0) return content;
    if (count > 0) {
      content.append(bytes.data(), static_cast<std::size_t>(count));
    } else if (errno != EINTR) {
      return cannotRead(errno);
    }
  }
}

Result<std::ifstream> openForReading(const std::filesystem::path& path) {
  std::error_code ignored;
  if (std::filesystem::is_directory(path, ignored)) {
    return fail(ErrorCode::kIo, "Cannot read " + path.string() + ": it is a folder");
  }
  FT_TRY_VOID(refuseSession(path));
  errno = 0;
  std::ifstream in(path, std::ios::binary);
  if (!in) return fail(ErrorCode::kIo, "Cannot read " + path.string() + ": " + reasonText(errno));
  return in;
}

void outliveFileSizeLimit() { std::signal(SIGXFSZ, SIG_IGN); }

Result<void> writeFileAtomically(const std::filesystem::path& path, const std::function<void(std::ostream&)>& write) {
  std::error_code error;
  const std::filesystem::file_status status = std::filesystem::status(path, error);
  if (std::filesystem::is_directory(status)) return cannotWrite(path, "it is a folder");
  if (std::filesystem::exists(status) && !std::filesystem::is_regular_file(status)) return writeThrough(path, write);
  // A symbolic link keeps pointing at its file: the file it names is replaced, not the link.
  const std::filesystem::path target = std::filesystem::is_symlink(std::filesystem::symlink_status(path, error))
                                           ? std::filesystem::weakly_canonical(path, error)
                                           : path;
  return writeAndRename(path, target.empty() ? path : target, write);
}

Result<void> replaceFileAtomically(const std::filesystem::path& path,
                                   const std::function<Result<void>(const std::filesystem::path&)>& write) {
  std::error_code error;
  if (std::filesystem::is_directory(path, error)) return cannotWrite(path, "it is a folder");
  const TemporaryFile temporary(path);
  // Some libraries tell a folder that is not there, or a full disk, by nothing but a number.
  if (const Descriptor descriptor(temporary.path(), O_WRONLY | O_CREAT | O_EXCL); !descriptor.valid())
    return cannotWrite(path, reasonText(errno));
  FT_TRY_VOID(write(temporary.path()));
  FT_TRY(const auto content, readFile(temporary.path()));
  return writeFileAtomically(path, [&content](std::ostream& out) { out << content; });
}

std::string formatNumber(double value) {
  if (std::isnan(value)) return "nan";
  std::array<char, 32> text;
  const auto [end, error] = std::to_chars(text.data(), text.data() + text.size(), value);
  FT_CHECK(error == std::errc());
  return {text.data(), end};
}

}  // namespace fieldtrue
