// itk_points FILE < points: what ITK makes of points of a file. FILE is a transform (.tfm, .h5) or a displacement field
// (.nrrd, .mha); points are lines of three numbers in ITK's world (LPS, mm), and so are the lines printed.
#include <itkDisplacementFieldTransform.h>
#include <itkHDF5TransformIOFactory.h>
#include <itkImageFileReader.h>
#include <itkMetaImageIOFactory.h>
#include <itkNrrdImageIOFactory.h>
#include <itkTransformFileReader.h>
#include <itkTxtTransformIOFactory.h>

#include <cstdio>
#include <iostream>
#include <string>

namespace {

using Field = itk::Image<itk::Vector<double, 3>, 3>;
using FieldTransform = itk::DisplacementFieldTransform<double, 3>;

FieldTransform::Pointer transformOf(const std::string& path) {
  if (path.ends_with(".tfm") || path.ends_with(".h5")) {
    const auto reader = itk::TransformFileReaderTemplate<double>::New();
    reader->SetFileName(path);
    reader->Update();
    return dynamic_cast<FieldTransform*>(reader->GetTransformList()->front().GetPointer());
  }
  const auto reader = itk::ImageFileReader<Field>::New();
  reader->SetFileName(path);
  reader->Update();
  const auto transform = FieldTransform::New();
  transform->SetDisplacementField(reader->GetOutput());
  return transform;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2) return 2;
  itk::HDF5TransformIOFactory::RegisterOneFactory();
  itk::TxtTransformIOFactory::RegisterOneFactory();
  itk::NrrdImageIOFactory::RegisterOneFactory();
  itk::MetaImageIOFactory::RegisterOneFactory();
  try {
    const FieldTransform::Pointer transform = transformOf(argv[1]);
    if (transform.IsNull()) return 1;
    FieldTransform::InputPointType p;
    while (std::cin >> p[0] >> p[1] >> p[2]) {
      const auto goes = transform->TransformPoint(p);
      std::printf("%.17g %.17g %.17g\n", goes[0], goes[1], goes[2]);
    }
  } catch (const itk::ExceptionObject& error) {
    std::cerr << error << '\n';
    return 1;
  }
  return 0;
}
