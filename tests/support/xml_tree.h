#pragma once

#include <QByteArray>
#include <QMap>
#include <QString>
#include <QXmlStreamReader>
#include <functional>
#include <memory>
#include <vector>

namespace fieldtrue::testing {

/// One element of a page that is well-formed XML.
struct XmlElement {
  QString tag;
  QMap<QString, QString> attributes;
  QString text;  ///< Of the element and everything below it.
  std::vector<std::unique_ptr<XmlElement>> children;

  /// Every element below with that tag, in document order.
  std::vector<const XmlElement*> all(const QString& wanted) const {
    std::vector<const XmlElement*> found;
    collect(wanted, found);
    return found;
  }
  bool hasClass(const QString& name) const {
    return attributes.value(QStringLiteral("class")).split(u' ').contains(name);
  }

 private:
  void collect(const QString& wanted, std::vector<const XmlElement*>& found) const {
    for (const auto& child : children) {
      if (child->tag == wanted) found.push_back(child.get());
      child->collect(wanted, found);
    }
  }
};

/// The root of a page. @param error what is not well-formed and where, empty when all is
inline std::unique_ptr<XmlElement> parseXml(const QByteArray& page, QString& error) {
  auto root = std::make_unique<XmlElement>();
  std::vector<XmlElement*> open{root.get()};
  QXmlStreamReader reader(page);
  while (!reader.atEnd()) {
    const auto token = reader.readNext();
    if (token == QXmlStreamReader::StartElement) {
      auto child = std::make_unique<XmlElement>();
      child->tag = reader.name().toString();
      for (const auto& attribute : reader.attributes()) {
        child->attributes[attribute.name().toString()] = attribute.value().toString();
      }
      open.back()->children.push_back(std::move(child));
      open.push_back(open.back()->children.back().get());
    } else if (token == QXmlStreamReader::EndElement) {
      open.pop_back();
    } else if (token == QXmlStreamReader::Characters) {
      for (XmlElement* element : open) element->text += reader.text();
    }
  }
  error =
      reader.hasError() ? QStringLiteral("line %1: %2").arg(reader.lineNumber()).arg(reader.errorString()) : QString();
  return root;
}

}  // namespace fieldtrue::testing
