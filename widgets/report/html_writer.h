#pragma once

#include <QByteArray>
#include <QXmlStreamWriter>
#include <initializer_list>
#include <string>
#include <utility>

namespace fieldtrue::widgets {

/// Writes one HTML page that is also well-formed XML. Everything given as text is escaped, and characters that XML
/// cannot hold are replaced.
class HtmlWriter {
 public:
  using Attributes = std::initializer_list<std::pair<const char*, std::string>>;

  /// Opens the page up to the body.
  /// @param style a style sheet without '<', '>' and '&'
  HtmlWriter(const std::string& title, const char* style);

  void open(const char* tag, Attributes attributes = {});
  void close();
  void text(const std::string& text);
  /// An element that holds only text.
  void element(const char* tag, const std::string& text, Attributes attributes = {});
  /// An element that HTML never closes, like img.
  void emptyElement(const char* tag, Attributes attributes);

  /// Closes everything that is open. @return the page, UTF-8
  QByteArray finish();

 private:
  QByteArray page_;
  QXmlStreamWriter xml_;
};

}  // namespace fieldtrue::widgets
