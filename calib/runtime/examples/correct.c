/* Corrects poses from standard input, one a line: x y z [m] qw qx qy qz; four zeros for no orientation.
 *   cc correct.c $(pkg-config --cflags --libs fieldtrue_runtime) -o correct && ./correct lab.ftcal.json < poses.txt */
#include <fieldtrue_runtime.h>
#include <stdio.h>

int main(int argc, char** argv) {
  fieldtrue_calibration* calibration = NULL;
  fieldtrue_pose pose;
  if (argc != 2) {
    fprintf(stderr, "usage: correct CALIBRATION < poses\n");
    return 2;
  }
  if (fieldtrue_load(argv[1], &calibration) != FIELDTRUE_OK) {
    fprintf(stderr, "%s\n", fieldtrue_error());
    return 1;
  }
  while (scanf("%lf %lf %lf %lf %lf %lf %lf", &pose.position_m[0], &pose.position_m[1], &pose.position_m[2],
               &pose.orientation_wxyz[0], &pose.orientation_wxyz[1], &pose.orientation_wxyz[2],
               &pose.orientation_wxyz[3]) == 7) {
    const int inside = fieldtrue_inside(calibration, pose.position_m);
    fieldtrue_correct(calibration, FIELDTRUE_FIRST_SENSOR, &pose, &pose);
    printf("%.17g %.17g %.17g %.17g %.17g %.17g %.17g %s\n", pose.position_m[0], pose.position_m[1], pose.position_m[2],
           pose.orientation_wxyz[0], pose.orientation_wxyz[1], pose.orientation_wxyz[2], pose.orientation_wxyz[3],
           inside ? "inside" : "outside");
  }
  fieldtrue_free(calibration);
  return 0;
}
