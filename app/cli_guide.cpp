#include <QString>
#include <string>

#include "app/cli.h"
#include "widgets/guide/guide.h"

/// guide: prints a page of the documentation.
namespace fieldtrue::cli {
namespace {

struct GuideOptions {
  std::string page = widgets::kGuideIndex;
};

Outcome runGuide(const GuideOptions& options, const CommonOptions&) {
  const auto text = widgets::guideText(QString::fromStdString(options.page));
  if (!text) return wrongUsage(text.error());
  Answer answer;
  answer.text = text->toStdString();
  answer.json = {{"page", options.page}, {"markdown", answer.text}, {"pages", nlohmann::json::array()}};
  for (const widgets::GuidePage& page : widgets::guidePages())
    answer.json["pages"].push_back({{"id", page.id.toStdString()}, {"title", page.title.toStdString()}});
  return answer;
}

}  // namespace

void addGuideCommand(CommandLine& line) {
  auto [command, options] = line.add("guide", "Print a page of the guide, or its index", runGuide);
  command->add_option("page", options->page, "Name of the page, as the index has it: methods, diagnosis, ...")
      ->type_name("PAGE");
}

}  // namespace fieldtrue::cli
