#include <QCoreApplication>
#include <QFile>
#include <cstdio>

#include "calib/core/exception_barrier.h"
#include "widgets/figures/picture_request.h"
#include "widgets/views/draw_picture.h"

/// fieldtrue-pictures: reads what is to be drawn from stdin, writes the drawn pictures to stdout. Command lines start
/// it, so that they need nothing that draws.
int main(int argc, char** argv) {
  using namespace fieldtrue::widgets;
  QCoreApplication application(argc, argv);
  QFile in, out;
  const bool open = in.open(stdin, QIODevice::ReadOnly) && out.open(stdout, QIODevice::WriteOnly);
  const auto requests = open ? requestsFromBytes(in.readAll()) : fieldtrue::fail(fieldtrue::ErrorCode::kIo, "no pipes");
  if (!requests) {
    std::fprintf(stderr, "fieldtrue-pictures draws for fieldtrue-cli, which tells it what on stdin: %s\n",
                 requests.error().message.c_str());
    return 1;
  }
  const auto drawn = fieldtrue::withBarrier("nothing was drawn", [&] { return toBytes(drawPictures(*requests)); });
  if (!drawn) std::fprintf(stderr, "%s\n", drawn.error().message.c_str());
  return drawn && out.write(*drawn) == drawn->size() && out.flush() ? 0 : 1;
}
