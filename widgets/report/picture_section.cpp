#include "widgets/report/picture_section.h"

#include "widgets/report/html_writer.h"

namespace fieldtrue::widgets {
namespace {

std::string asDataUrl(const QByteArray& png) { return "data:image/png;base64," + png.toBase64().toStdString(); }

void writeMissing(HtmlWriter& html, const std::string& why) {
  html.element("p", "Pictures could not be drawn: " + why + ".", {{"class", "notice"}});
}

void writeFigure(HtmlWriter& html, const CaptionedPicture& picture, const QByteArray& light, const QByteArray& dark) {
  html.open("figure", {{"id", picture.id}});
  html.open("picture");
  html.emptyElement("source", {{"media", "screen and (prefers-color-scheme: dark)"}, {"srcset", asDataUrl(dark)}});
  html.emptyElement("img", {{"src", asDataUrl(light)}, {"alt", picture.caption}});
  html.close();
  html.element("figcaption", picture.caption);
  html.close();
}

std::vector<PictureRequest> lightAndDark(const std::vector<CaptionedPicture>& pictures) {
  std::vector<PictureRequest> requests;
  for (const CaptionedPicture& picture : pictures) {
    for (const bool dark : {false, true}) {
      requests.push_back(picture.content);
      requests.back().dark = dark;
    }
  }
  return requests;
}

}  // namespace

void writePictures(HtmlWriter& html, const std::vector<CaptionedPicture>& pictures, const DrawPictures& draw) {
  if (!draw) return writeMissing(html, "they were not asked for");
  const std::vector<Result<QByteArray>> drawn = draw(lightAndDark(pictures));
  FT_CHECK(drawn.size() == 2 * pictures.size());
  std::vector<std::size_t> whole;
  std::string why;
  for (std::size_t i = 0; i < pictures.size(); ++i) {
    const Result<QByteArray>& worse = drawn[2 * i] ? drawn[2 * i + 1] : drawn[2 * i];
    if (worse) whole.push_back(i);
    if (!worse && why.empty()) why = worse.error().message;
  }
  if (!why.empty()) writeMissing(html, why);
  if (whole.empty()) return;
  html.open("div", {{"class", "pictures"}});
  for (const std::size_t i : whole) writeFigure(html, pictures[i], *drawn[2 * i], *drawn[2 * i + 1]);
  html.close();
}

}  // namespace fieldtrue::widgets
