#include "widgets/report/html_writer.h"

#include <QString>

namespace fieldtrue::widgets {
namespace {

/// XML 1.0 allows no control characters but tab and line ends, and no U+FFFE and U+FFFF.
QString xmlText(const std::string& text) {
  QString result = QString::fromStdString(text);
  for (QChar& c : result) {
    const bool control = c < u' ' && c != u'\t' && c != u'\n' && c != u'\r';
    if (control || c >= QChar(0xFFFE)) c = QChar::ReplacementCharacter;
  }
  return result;
}

}  // namespace

HtmlWriter::HtmlWriter(const std::string& title, const char* style) : xml_(&page_) {
  xml_.writeDTD(QStringLiteral("<!DOCTYPE html>"));
  open("html", {{"xmlns", "http://www.w3.org/1999/xhtml"}, {"lang", "en"}});
  open("head");
  emptyElement("meta", {{"charset", "utf-8"}});
  emptyElement("meta", {{"name", "viewport"}, {"content", "width=device-width, initial-scale=1"}});
  element("title", title);
  element("style", style);
  close();
  open("body");
}

void HtmlWriter::open(const char* tag, Attributes attributes) {
  xml_.writeStartElement(QString::fromLatin1(tag));
  for (const auto& [name, value] : attributes) xml_.writeAttribute(QString::fromLatin1(name), xmlText(value));
}

void HtmlWriter::close() {
  // The empty text keeps an empty element from being written as <td/>, which HTML reads as an opening tag.
  xml_.writeCharacters(QString());
  xml_.writeEndElement();
}

void HtmlWriter::text(const std::string& text) { xml_.writeCharacters(xmlText(text)); }

void HtmlWriter::element(const char* tag, const std::string& content, Attributes attributes) {
  open(tag, attributes);
  text(content);
  xml_.writeEndElement();
}

void HtmlWriter::emptyElement(const char* tag, Attributes attributes) {
  open(tag, attributes);
  xml_.writeEndElement();
}

QByteArray HtmlWriter::finish() {
  xml_.writeEndDocument();
  return page_;
}

}  // namespace fieldtrue::widgets
