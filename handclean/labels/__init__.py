"""Labelling: which raw point is which marker.

A take's way through this package, in order:

1. `label.label` is the entry. `points.cloud_of` lists the take's points frame by frame;
   `target.make_target` turns the subject's hand into something to look for; and
   `track.tracker.track_setup` turns settings into numbers at the take's frame rate.
2. `track_take.find_first_fit` finds the hand in one of the fullest frames.
   `search.align.search_frame` clusters the points (`clusters`), lays a stiff hand onto
   each cluster (`search.orientations`, `search.icp`), then assigns points and solves
   for the pose in turns (`track.fit.assign_and_solve`).
3. `track_take.track_take` tracks the hand from there to both ends of the take, and
   finds it again where it was lost. `track.links.path_links` links points of successive
   frames to paths, by nearness alone. `track.frames.track_frames` goes from frame to
   frame:
   - `track.prediction` says where each marker is expected, and how sure that is: this
     is where gates widen for a marker out of sight;
   - `track.assign.assign_points` assigns points within these gates, with the links'
     costs (`track.links.add_link_costs`);
   - `track.outliers.reject_outliers` refuses ghosts: points beyond a marker's threshold
     (`track.residual_gate`) after the fit;
   - `track.other_poses.recover_pose` tries other poses where the fit is poor, with
     single fingers restarted, searched for or exchanged (`track.alternatives`);
   - `track.outliers.accept_reappearing` takes markers back that were out of sight;
   - `track.record.record_frame` writes the frame.
4. Still in `track_take`, `review.repair` tracks stretches again that fit poorly, and
   `review.review` tries paths of points under other names (settings ``repair`` and
   ``review``).
5. `checks` ask whether the result can be right: enough markers of the hand
   (`evidence`), the unit of length (`unit`), the other hand (`side`).

`baseline` is the method without a model to compare with. Bundles of arrays that
compiled functions share are in `track.state` and `track.tracker`.
"""
