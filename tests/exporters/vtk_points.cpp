// vtk_points grid FILE.vti | landmarks FILE.vtp | places FILE.vtp < points: what VTK makes of points of a file, lines
// of three numbers in metres. `places` prints the file's points, and the vector that error_before_m adds to each.
#include <vtkDataArray.h>
#include <vtkGridTransform.h>
#include <vtkImageData.h>
#include <vtkNew.h>
#include <vtkPointData.h>
#include <vtkPolyData.h>
#include <vtkThinPlateSplineTransform.h>
#include <vtkXMLImageDataReader.h>
#include <vtkXMLPolyDataReader.h>

#include <cstdio>
#include <iostream>
#include <string>

namespace {

void mapPoints(vtkAbstractTransform& transform) {
  double p[3];
  while (std::cin >> p[0] >> p[1] >> p[2]) {
    double goes[3];
    transform.TransformPoint(p, goes);
    std::printf("%.17g %.17g %.17g\n", goes[0], goes[1], goes[2]);
  }
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 3) return 2;
  const std::string kind = argv[1];
  if (kind == "grid") {
    vtkNew<vtkXMLImageDataReader> reader;
    reader->SetFileName(argv[2]);
    reader->Update();
    vtkNew<vtkGridTransform> transform;
    transform->SetDisplacementGridConnection(reader->GetOutputPort());
    transform->SetInterpolationModeToLinear();
    vtkImageData* image = reader->GetOutput();
    image->GetPointData()->SetScalars(image->GetPointData()->GetArray("displacement_m"));
    transform->SetDisplacementGridData(image);
    mapPoints(*transform);
    return 0;
  }
  vtkNew<vtkXMLPolyDataReader> reader;
  reader->SetFileName(argv[2]);
  reader->Update();
  vtkPolyData* data = reader->GetOutput();
  if (kind == "landmarks") {
    vtkDataArray* targets = data->GetPointData()->GetArray("target_m");
    if (targets == nullptr) return 1;
    vtkNew<vtkPoints> target;
    target->SetDataTypeToDouble();
    for (vtkIdType i = 0; i < targets->GetNumberOfTuples(); ++i) target->InsertNextPoint(targets->GetTuple3(i));
    vtkNew<vtkThinPlateSplineTransform> transform;
    transform->SetBasisToR();
    transform->SetSourceLandmarks(data->GetPoints());
    transform->SetTargetLandmarks(target);
    mapPoints(*transform);
    return 0;
  }
  vtkDataArray* errors = data->GetPointData()->GetArray("error_before_m");
  if (errors == nullptr) return 1;
  for (vtkIdType i = 0; i < data->GetNumberOfPoints(); ++i) {
    const double* p = data->GetPoint(i);
    const double* e = errors->GetTuple3(i);
    std::printf("%.17g %.17g %.17g %.17g %.17g %.17g\n", p[0], p[1], p[2], e[0], e[1], e[2]);
  }
  return 0;
}
