"""Study of retargeting: what the face tracker reads in recordings and in a face that mimics them."""
